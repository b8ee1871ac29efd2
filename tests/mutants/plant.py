#!/usr/bin/python3
"""Bugs that tests once did not see, each with the test that has to.

plant.py --check SOURCE              each bug can still be planted, and each test is there
plant.py SOURCE SCRATCH [NAME ...]   plants them, one at a time, in a copy of the sources in SCRATCH; each test has to fail
  --build-command CMD                what builds a target; {build} and {target} are filled in
"""
import argparse
import pathlib
import re
import shutil
import subprocess
import sys
from typing import NamedTuple

CONTACT, CORE, EFFECTS, GRID, SOLVER = "vdbfrac/contact/src/", "vdbfrac/core/src/", "vdbfrac/effects/src/", "vdbfrac/grid/src/", "solver/src/"
FRACTURE = EFFECTS + "fracture.cpp"
FRACTURE_LAW = EFFECTS + "fracture_law.cpp"


class Bug(NamedTuple):
    name: str
    file: str
    old: str      # occurs once in the file
    new: str
    program: str  # a target of tests/CMakeLists.txt
    test: str     # of gtest, without its parameters


BUGS = [
    Bug("nodal toughness constant 20 % larger", FRACTURE_LAW, "kNodalFactor = 0.25;", "kNodalFactor = 0.3;",
        "fracture_test", "BarOnset.UnderToughnessKappaIsThatOfTheTable"),
    Bug("toughness constant 20 % larger", FRACTURE_LAW, "law.radius > 0 ? A / law.radius", "law.radius > 0 ? 1.2 * A / law.radius",
        "fracture_test", "BarOnset.UnderToughnessKappaIsThatOfTheTable"),
    Bug("energy release found 20 % too small", GRID + "energy_release.cpp", "kFoundOnLattice = .95,", "kFoundOnLattice = 1.14,",
        "fracture_test", "ClampedStrip.CrackSetsOffWhereTheEnergyThatItReleasesIsTheToughness"),
    Bug("cracks stop short of blocks that are not there", "tetmesh/skin/src/crack_lattice.cpp", "for (int z = -1; z < Field", "for (int z = 99; z < Field",
        "skin_test", "CrackLattice.SeesAllVoxelsRoundANodeAtTheCornerOfABlock"),
    Bug("lists of frames lead out of the folder", CORE + "run_records.cpp", "if (!liesBelow(w.path))", "if (false)",
        "run_records_test", "RunRecords.FilesOutsideOfTheFolderAreRefused"),
    Bug("halved voxels are read in the host's locale", "vdbfrac/base/src/number_text.cpp", "return error == std::errc() && stop == end ? std::optional(value) : std::nullopt;",
        "return std::strtod(std::string(text).c_str(), nullptr);",
        "locale_test", "Locales.ABranchMayHalveItsVoxels"),
    Bug("a band forgets what re-levelling made of it", GRID + "phi_nodes.cpp", "if (it != band.end() && it->voxel == voxel) it->phi = value;", "(void)value;",
        "grid_test", "Relevel.ABandFollowsTheGrid"),
    Bug("what cracks take is booked by half", CORE + "simulation.cpp", "    elasticEnergy_ -= gone;", "    elasticEnergy_ -= gone / 2;",
        "laws_test", "EnergyFlows.RemovedIsWhatTheMaterialHeldThatIsGone"),
    Bug("shells are as thick as axes run through them", CORE + "rest_notes.cpp", "std::min(rise, 1.) * length", "length",
        "solved_steps_test", "RestNotes.ThinPlatesAndShellsAreToldHoweverTheyLie"),
    Bug("points of an old cache stay beside new faces", CORE + "point_cache.cpp", "        removeFile(mdd);\n", "",
        "point_cache_test", "PointCaches.LeaveNoOldPointsBesideNewFaces"),
    Bug("level sets that are cut off at high x pass", GRID + "vdb_reader.cpp", "if (c[axis] == box.min()[axis] || c[axis] == box.max()[axis]) return true;",
        "if (c[axis] == box.min()[axis]) return true;",
        "grid_test", "VdbFiles.SurfacesThatAreCutOffOnAnySideAreRefused"),
    Bug("weak spots are no easier to tear", GRID + "tension.cpp", "(2 * average.youngsModulus * factorAt(average, c));\n    });", "(2 * average.youngsModulus);\n    });",
        "fracture_test", "FracturePlaces.HaveTheResistanceOfTheirSpot"),
    Bug("tips in weak spots release no more", GRID + "tension.cpp", "release.G / factorAt(average, tips[G.size()])", "release.G",
        "fracture_test", "FracturePlaces.AreLikeAnotherToughnessWhereTheyHoldAll"),
    Bug("spots far away make searches wide", "vdbfrac/effects/src/fracture_places.cpp", "least = std::min(least, factor(dx * c.toVec()));", "least *= std::min(1., factor(dx * c.toVec()));",
        "fracture_test", "FracturePlaces.CostNothingWhereTheLoadIsLow"),
    Bug("out of one collider, into the next", EFFECTS + "collider_drawing.cpp", "constexpr int kRounds = 16;", "constexpr int kRounds = 1;",
        "collider_test", "DrawnContact.LiesInAGroove"),
    Bug("drawn through blades", EFFECTS + "collider_drawing.cpp", "std::min(kDeepest * dx_, halfThickness / 2)", "(kDeepest + 0 * halfThickness) * dx_",
        "collider_test", "DrawnContact.IsNotThrownThroughWhatIsThin"),
    Bug("only half drawn apart", EFFECTS + "contact_drawing.cpp", "for (const bool isFirst : {true, false})", "for (const bool isFirst : {true})",
        "collider_test", "DrawnPieces.AreDrawnApartWhereAskedFor"),
    Bug("pieces inside out push others", EFFECTS + "contact_drawing.cpp", "if (!(other.volume > 0)) continue;", "if (other.volume == 0) continue;",
        "collider_test", "DrawnPieces.StayWhereTheyOnlyTouch"),
    Bug("thin pieces push others through", EFFECTS + "contact_drawing.cpp", "std::clamp(std::min(deep, thin), 0., 1.)", "std::clamp(std::min(deep, 1 + 0 * thin), 0., 1.)",
        "collider_test", "DrawnPieces.AreNotThrownThroughThinOnes"),
    Bug("deep pieces are drawn apart twice", EFFECTS + "contact_drawing.cpp", "if (isFirst) rest[b][p] = depth", "rest[b][p] = depth",
        "collider_test", "DrawnPieces.AreDrawnApartLessWhereTheyAreDeep"),
    Bug("deep points leave colliders in steps", EFFECTS + "collider_drawing.cpp", "isDeep = isDeep || *share < 1;", "isDeep = *share < 0;",
        "collider_test", "DrawnContact.LiesInAGroove"),
    Bug("closed lips are drawn apart", EFFECTS + "contact_drawing.cpp", "kTouching = .01;", "kTouching = 1e-4;",
        "collider_test", "DrawnPieces.StayWhereTheyOnlyTouch"),
    Bug("crumbs fall off at rest", GRID + "crumbs.cpp", "isBesideLarger(c, part, size)) isCrumb[part(c)] = 1;", "isBesideLarger(c, part, size)) isCrumb[part(c)] = 0;",
        "solved_steps_test", "RestCrumbs.AreLeftOutBesideLargerParts"),
    Bug("rims turn back on themselves", "tetmesh/skin/src/unfolded_parts.cpp", "constexpr int kRounds = 20;", "constexpr int kRounds = 0;",
        "skin_test", "SkinCut.ClosedLipsHaveNoSliversAlongRims"),
    Bug("seeds mirror each other", "tetmesh/src/noise.cpp", "start = mixedBits(seed)", "start = seed",
        "skin_test", "Noise.OfOneSeedSaysNothingOfAnother"),
    Bug("weak spots only under the driver tension", FRACTURE, "driven.psi[i] /= places_", "(void)places_",
        "fracture_test", "FracturePlaces.TearWhereTheyAreWeakest"),
    Bug("scatter by voxel", "vdbfrac/effects/src/fracture_places.cpp", "return [this, dx](Coord c) { return factor(dx * c.toVec());", "return [this, dx](Coord c) { return factor((dx > 0 ? .0625 : 0) * c.toVec());",
        "fracture_test", "FracturePlaces.ScatterByPlaceAndSeed"),
    Bug("front half as fast", FRACTURE, "mobility = values_.number(", "mobility = 0.5 * values_.number(",
        "laws_test", "Front.MovesTheFasterTheMoreItIsOverloaded"),
    Bug("nodes that split stand still", CORE + "simulation.cpp", "carry(*field, body.firstNode, oldCount, update.previousNode);",
        "carry(*field, body.firstNode, oldCount, update.previousNode);\n"
        "        std::vector<bool> taken(oldCount);\n"
        "        for (std::size_t i = 0; i < update.previousNode.size(); ++i) {\n"
        "            if (taken[update.previousNode[i]]) state_.v[body.firstNode + i].setZero();\n"
        "            taken[update.previousNode[i]] = true;\n"
        "        }",
        "laws_test", "Cut.LeavesEachPieceItsMomentumAndKineticEnergy"),
    Bug("front_cfl ignored", FRACTURE, "frontCfl_(scene.time.frontCfl)", "frontCfl_(0.5)",
        "laws_test", "Front.ThatCouldGoFartherMovesByFrontCflVoxelsInAStepOfFixedLength"),
    Bug("front_cfl ignored by automatic steps", FRACTURE, "return frontCfl_ * dx_ / (waveSpeed", "return 0.5 * dx_ / (waveSpeed",
        "laws_test", "Front.OnceItMovesAutomaticStepsTakeARayleighWaveNoFartherThanFrontCflVoxels"),
    Bug("node_cfl ignored", CORE + "step_control.cpp", "settings_.nodeCfl * h_ / spread", "h_ / spread",
        "laws_test", "Steps.AutomaticOnesMoveNodesOfACellApartByNodeCflCellsAtMost"),
    Bug("grip_margin ignored", FRACTURE, "values.has(\"grip_margin\") ?", "values.has(\"grip_margin\") && false ?",
        "laws_test", "Fracture.StopsAtTheMarginOfTheGripsAndNotBeforeIt"),
    Bug("linear systems solved to half", SOLVER + "backward_euler.cpp", "return std::max(settings_.linearTolerance,",
        "return 0.5 + 0 * std::max(settings_.linearTolerance,",
        "numerics_test", "InexactNewton.LinearSystemsAreSolvedAsFarAsTheToleranceSays"),
    Bug("vel halved", GRID + "world_fields.cpp", "share /= share.sum();", "share /= 2 * share.sum();",
        "laws_test", "VelGrid.HoldsTheVelocityOfTheSurfaceNearby"),
    Bug("fragment_id of the first triangle", GRID + "world_fields.cpp", "surface.fragment[n]", "surface.fragment[0]",
        "laws_test", "FragmentIdGrid.HoldsTheIdOfTheBodyThatIsNearer"),
    Bug("couplings that grew not taken up", SOLVER + "coupled_diagonal.cpp", "grows = grows || is", "grows = grows && is",
        "linear_solver_test", "CoupledSystems.AFewMoreOfManyAreTakenUp"),
    Bug("lines miss where edges meet", GRID + "surface_band.cpp", "y < to; ++y", "y <= to; ++y",
        "grid_test", "SurfaceBand.FacesOnVoxelPlanesAndHollowsHaveSigns"),
    Bug("specks stay", GRID + "surface_band.cpp", "if (!isReached[i]) *phiAt", "if (false) *phiAt",
        "grid_test", "SurfaceBand.NarrowGapsLeaveNoSpecks"),
    Bug("bands not widened", GRID + "surface_band.cpp", "while (widen())", "if (widen())",
        "grid_test", "SurfaceBand.IsTheDistanceToTheSurfaceWithTheSignOfTheSolid"),
    Bug("energy not by volume", GRID + "transfer.cpp", "float(share.energy / share.volume)", "float(share.energy)",
        "laws_test", "EnergyGrid.HoldsTheEnergyOfAUniformStrainInWholeAndInCutVoxels"),
    Bug("mass of the linear cut", "tetmesh/src/cut_mesh.cpp", "if (shape && !lattice_.wholeTets) correct(shape);", "",
        "laws_test", "Body.HasTheMassOfItsShape"),
    Bug("what is moved out of colliders keeps its velocity", EFFECTS + "collider_drawing.cpp", "velocity -= share", "velocity -= 0 * share",
        "collider_test", "DrawnContact.IsMovedOutOfCollidersAndTheStateIsNot"),
    Bug("what has passed into colliders is smeared over them", EFFECTS + "collider_drawing.cpp", "none = 2 * all;", "none = 20 * all;",
        "collider_test", "DrawnContact.LiesOnWhatMoves"),
    Bug("point caches have colliders where they start", CORE + "point_cache.cpp", "stages_, double(number)", "stages_, 0 * double(number)",
        "collider_test", "DrawnContact.IsTheSameInAPointCache"),
    Bug("edges bridge a crack", "tetmesh/src/cut_mesh_corrections.cpp", "if (!(seenPhi(corner) < 0)) return -1;", "",
        "cut_test", "Edges.DoNotBridgeACrackOfOneRowOfVoxels"),
    Bug("tets divided one way only", "tetmesh/src/true_share.cpp", "{0, 1, 3, 2}, {0, 2, 1, 3}", "{0, 1, 2, 3}, {0, 1, 2, 3}",
        "cut_test", "MirroredSolids.HaveMirroredMasses"),
    Bug("lips half as far apart as they are", "tetmesh/skin/src/lips.cpp", "return 0.5 * (s - ", "return 0.25 * (s - ",
        "laws_test", "ObjFaces.CloseTheLipsOfAKerf"),
    Bug("rims keep the teeth of their voxels", "tetmesh/skin/src/fairing.cpp", "constexpr int kRounds = 15;", "constexpr int kRounds = 0;",
        "skin_test", "SkinCut.ClosedLipsOfAJaggedCrackHaveSmoothRims"),
    Bug("rims of dense meshes keep the teeth of their voxels", "tetmesh/skin/src/fairing.cpp", "after == from || further > reach", "true",
        "skin_test", "SkinCut.ClosedLipsOfAJaggedCrackHaveSmoothRims"),
    Bug("no sight across a crack at an angle", "vdbfrac/contact/src/broad_phase.cpp", "return round_[g] == sample;", "return true;",
        "contact_test", "ContactSearch.SeeAcrossACrackAtAnAngle"),
    Bug("specks hang in the air", "tetmesh/skin/src/skin_cut.cpp", "removeSpecks(*topology_, now, dx_, cut);", "",
        "skin_test", "SkinCut.LeavesNoSpecksWithoutMaterial"),
    Bug("slivers stay along rims", "tetmesh/skin/src/slivers.cpp", "kMost = 20;", "kMost = 0;",
        "skin_test", "SkinCut.ClosedLipsHaveNoSliversAlongRims"),
    Bug("joining points of rims leaves holes", "tetmesh/skin/src/slivers.cpp", "!staysSurface(edge) || ", "",
        "skin_test", "SkinCut.ClosedLipsHaveNoSliversAlongRims"),
    Bug("textures are smeared over seams", "tetmesh/skin/src/skin_corners.cpp", "if (isBeyond(kUv)) chart.uv = there.triangle;", "",
        "skin_test", "SkinTextures.AreThoseOfThePlaceAsFarAsTheSeam"),
    Bug("crumbs are drawn as points", "tetmesh/skin/src/lips.cpp", "pieces.isSmall(piece))", "pieces.isSmall(piece) && false)",
        "skin_test", "SkinCut.ClosedLipsLeaveCrumbsTheirSize"),
    Bug("crumbs with whole triangles are taken for more", "tetmesh/skin/src/cut_pieces.cpp", "pieces_.box_[sets_.find(own)].extend(boxOf(skin_, t));", "pieces_.box_[sets_.find(own)].extend(boxOf(skin_, t)).extend(Vec3::Constant(1e9));",
        "skin_test", "SkinCut.ClosedLipsLeaveCrumbsTheirSize"),
    Bug("whole triangles of specks stay", "tetmesh/skin/src/specks.cpp", "cut.fate[triangle] = SkinCut::Fate::gone;", ";",
        "skin_test", "SkinCut.LeavesNoSpecksWithoutMaterial"),
    Bug("rims of one lip are bent", "tetmesh/skin/src/slivers.cpp", "(!edge.isFolded && bendsRim(edge))", "false",
        "skin_test", "SkinCut.ClosedLipsHaveNoSliversAlongRims"),
    Bug("hollows without size stay", "tetmesh/skin/src/skin_cut.cpp", "removeTiny(*topology_, dx_, cut);", "",
        "skin_test", "SkinCut.ClosedLipsLeaveNoHollowWithoutSize"),
    Bug("closed lips do not meet", "tetmesh/skin/src/lips.cpp", "meet(skin, lattice.voxelSize(), cut);", "",
        "skin_test", "SkinRiders.ClosedLipsMeet"),
    Bug("points outside swing with one tet", "tetmesh/skin/src/mean_motion.cpp", "kFrom = 0.05, kWholly = 0.15", "kFrom = 1e8, kWholly = 1e9",
        "skin_test", "SkinRiders.GoLittleFartherThanTheNodesThatCarryThem"),
    Bug("lips go along with each other round the front", "tetmesh/skin/src/mean_motion.cpp", "search.steps() <= edgesTo(n - from)", "search.steps() <= 99",
        "skin_test", "SkinLips.PartFromTheFrontOn"),
    Bug("point caches take nodes between two frames for those of the last", "vdbfrac/core/src/point_cache.cpp", "putWayTo(int(frame), simulation, archive);", "",
        "point_cache_test", "PointCaches.BeginAtRestWhereverTheRunStops"),
    Bug("what contact gives back was put in", "vdbfrac/core/src/energy_accounts.cpp", "> kFlownApart * mostIn_", "> kFlownApart * putIn_",
        "knobs_test", "Choices.StepsThatFlyApartOnAColliderSaySo"),
    Bug("ends of rims shrink", "tetmesh/skin/src/fairing.cpp", "if (round.isEnd[i]) moved[i]", "if (false) moved[i]",
        "skin_test", "SkinCut.ClosedLipsEndWhereTheCrackDoes"),
    Bug("points ride on the other lip where both share nodes", "tetmesh/skin/src/riders.cpp", "isBesideCrack(X) ? onThisSide(X)", "false ? onThisSide(X)",
        "skin_test", "SkinLips.NoFaceJoinsThoseOfAThinCrack"),
    Bug("skin holds lips together two voxels behind the front", "tetmesh/skin/src/node_search.h", "constexpr int kRound = 1;", "constexpr int kRound = 2;",
        "skin_test", "SkinLips.NoFaceJoinsThoseOfAThinCrack"),
    Bug("points ride on any tet of the nearest node", "tetmesh/skin/src/riders.cpp", "if (tets_.empty() || best.point.isInTet()) return best;", "return best;",
        "skin_test", "SkinRiders.RideInTheTetsThatTheyLieIn"),
    Bug("crossings of edges one voxel node off", "tetmesh/skin/src/crossings.cpp", "return a.X + a.c / (a.c - b.c) * (b.X - a.X);", "return a.X;",
        "skin_test", "SkinCut.RimsAreSmooth"),
    Bug("torn faces come through thin flaps", "tetmesh/skin/src/lips.cpp", "depth[i] = near.depth(cut.points[i].X, kDepth * lattice.voxelSize());", "depth[i] = 0;",
        "skin_test", "SkinCut.ClosedLipsStayBelowTheSkin"),
    Bug("torn faces stay folded", "tetmesh/skin/src/fairing.cpp", "if (area[f].dot(round[corner(f, k)]) < 0)", "if (area[f].dot(round[corner(f, k)]) < -1e300)",
        "skin_test", "SkinCut.ClosedLipsStayBelowTheSkin"),
    Bug("crossings of edges a thousandth off", "tetmesh/skin/src/crossings.cpp", "return a.X + a.c / (a.c - b.c) * (b.X - a.X);", "return a.X + .999 * a.c / (a.c - b.c) * (b.X - a.X);",
        "skin_test", "SkinOracle.KeepsAndRemovesWhatBooleansDo"),
    Bug("texture coordinates of parts of faces mixed up", "tetmesh/src/render_mesh.cpp", "values.push_back(w[0] * values[a.*which] + w[1] * values[b.*which]", "values.push_back(w[1] * values[a.*which] + w[0] * values[b.*which]",
        "solids_test", "CarvedMesh.KeepsWhatFacesCarry"),
    Bug("torn faces look inward", "tetmesh/skin/src/torn_faces.cpp", "if (normal_.dot(toOpen) >= 0) return;", "if (normal_.dot(toOpen) < 0) return;",
        "skin_test", "SkinCut.ClosesEveryPartOfATornBody"),
    Bug("groups of faces swapped in .obj", "tetmesh/src/obj_file.cpp",
        "if (!drawn_.torn[f]) continue;", "if (drawn_.torn[f]) continue;",
        "laws_test", "ObjFaces.AreInsideInAKerfAndOutsideOnTheOldSkin"),
    Bug("loads along y and z swapped", CORE + "stats_text.cpp",
        "number(load.y()) + ',' + number(load.z())", "number(load.z()) + ',' + number(load.y())",
        "laws_test", "StatsColumns.LoadsOfAGripCarryTheWeightAlongEachAxis"),
    Bug("mass damping halved", EFFECTS + "damping.cpp", "a_(mass)", "a_(0.5 * mass)",
        "laws_test", "Damping.OfTheMassSlowsFreeFlightAsEachIntegratorSolvesIt"),
    Bug("stiffness damping 30 % larger", EFFECTS + "damping.cpp", "b_(stiffness)", "b_(1.3 * stiffness)",
        "laws_test", "Damping.OfAModeIsHalfOfMassOverItsFrequencyAndOfStiffnessTimesIt"),
    Bug("keys turn about z, y, x", "vdbfrac/base/src/rotation.cpp",
        "Eigen::AngleAxisd(a.z(), Vec3::UnitZ()) * Eigen::AngleAxisd(a.y(), Vec3::UnitY()) *\n            Eigen::AngleAxisd(a.x(), Vec3::UnitX())",
        "Eigen::AngleAxisd(a.x(), Vec3::UnitX()) * Eigen::AngleAxisd(a.y(), Vec3::UnitY()) *\n            Eigen::AngleAxisd(a.z(), Vec3::UnitZ())",
        "laws_test", "Grips.KeysTurnAboutXThenYThenZ"),
    Bug("flat tets build walls", EFFECTS + "contact.cpp", "return targets_.isBlind(p.target, x);", "return targets_.isBlind(p.target, x) && false;",
        "contact_test", "OnLattice.WhatWasFlatBuildsNoWall"),
    Bug("a solve holds nothing that goes to and fro", EFFECTS + "contact.cpp", "withKnown(steadyPairsAt(x, inSolve_)", "withKnown(pairsAt(x, inSolve_.held())",
        "contact_test", "OnLattice.WhatGoesToAndFroIsHeld"),
    Bug("curves begin stretches with gaps", "tools/report/src/plots.cpp", "std::min_element(from, to, isHigher)", "std::max_element(from, to)",
        "cli_test", "Plots.KeepThePeakOfAColumnWithGaps"),
    Bug("torn faces of point caches are smeared", "tetmesh/src/cache_files.cpp", "corner.uv != RenderMesh::kNone && !drawn.torn[f]", "corner.uv != RenderMesh::kNone",
        "surface_input_test", "UsdFiles.TornFacesHaveTextureCoordinatesOfABox"),
    Bug("contact looks only where things go by themselves", EFFECTS + "contact.cpp", "    search_.lookBeside(surface_, targets_, x);\n", "",
        "contact_test", "ContactSearch.SeeWhatIsStoppedOnItsWay"),
    Bug("squeezing counts as tension", GRID + "nodal_stresses.h", "std::max(0., Eigen::SelfAdjointEigenSolver", "(Eigen::SelfAdjointEigenSolver",
        "grid_test", "Tension.OfWhatIsSqueezedIsNone"),
    Bug("a crack's points on the far side of its nodes", GRID + "passing.cpp", "voxel.toVec() - off * normal", "voxel.toVec() + off * normal",
        "grid_test", "Tension.OfACrackGoesOnInThePlaneThatItCameIn"),
    Bug("nodes off a crack's way as good as those on it", GRID + "passing.cpp", "kOff = .3", "kOff = 0",
        "grid_test", "Tension.OfACrackPrefersNodesThatItsWayMeets"),
    Bug("stress without its element's means", SOLVER + "element.cpp", "(1 - moduli.theta) * strains.e[t] + moduli.theta * strains.e[strains.mean]", "strains.e[t]",
        "kernel_test", "FlowCases.StressDoesTheWorkOfTheForces"),
    Bug("material forces without what moves the means", SOLVER + "element.cpp", "meanW + meanP.cwiseProduct(F - meanF).sum()", "meanW",
        "kernel_test", "ElementForces.AreThoseOfTheEnergy"),
    Bug("faces move along with a front", GRID + "energy_release.cpp", "J -= J.dot(face) * face;", ";",
        "grid_test", "EnergyRelease.OfAPlateIsThatOfItsFront"),
    Bug("spin about the origin", CORE + "simulation.cpp", "cross(state_.x[i] - center)", "cross(state_.x[i])",
        "laws_test", "Body.SetsOffWithItsVelocityAndSpinsAboutItsCenter"),
    Bug("arrival a step early", FRACTURE, "noteArrivals(body, front, all, context.time", "noteArrivals(body, front, all, context.time - context.dt",
        "laws_test", "Arrival.IsTheEndOfTheStepInWhichPhiRoseToZero"),
    Bug("reactions of explicit schemes turned round", SOLVER + "integrator.cpp", "mass[i] / dt * (state.v[i] - old) - force;",
        "force - mass[i] / dt * (state.v[i] - old);",
        "numerics_test", "Integrators.ReactionOfWhatIsHeldIsItsInertiaLessItsWeight"),
    Bug("damping takes no energy", EFFECTS + "damping.cpp", "return {0, inverseDt_ * taken, 0};", "return {0, 0, 0};",
        "laws_test", "EnergyAccounts.NameAllEnergyOfEachStepAlsoOfATear"),
    Bug("work of grips by the forces of the end", CORE + "grips.cpp", "work = 0.5 * (early + atEnd);", "work = atEnd;",
        "laws_test", "EnergyAccounts.NameAllEnergyOfEachStepAlsoOfATear"),
    Bug("what a static tear sets free forgotten", SOLVER + "integrator.cpp", ": still - pull.dot(", ": still - 0 * pull.dot(",
        "laws_test", "EnergyAccounts.NameAllEnergyOfEachStepAlsoOfATear"),
    Bug("line search takes any step", SOLVER + "backward_euler.cpp", "if (descends || level) {", "if (descends || level || true) {",
        "numerics_test", "LineSearch.NoIterationOfNewtonRaisesTheEnergyOfTheStep"),
    Bug("cut-back forgotten", CORE + "step_control.h", "trusted_ = dt < tried ? dt :",
        "trusted_ = dt < tried ? std::numeric_limits<double>::infinity() :",
        "laws_test", "Steps.AfterACutBackNoneIsTriedThatIsLongerThanTheLastOrTwiceAsLongAfterEachThatWasSolved"),
    Bug("no points on stretched edges", "vdbfrac/contact/include/vdbfrac/contact/edged_surface.h", "kLong = 1.5;", "kLong = 1e9;",
        "collider_test", "Collider.OfTwoVoxelsDoesNotPassBetweenSamples"),
    Bug("nodes that weigh next to nothing keep fragments awake", EFFECTS + "sleep.cpp", "context.mass[n] * context.v[n].squaredNorm()",
        "states[f].heaviest * context.v[n].squaredNorm()", "sleep_test", "Sleep.IsNotKeptOffByWhatWeighsNextToNothing"),
    Bug("bodies stand on a base without its edges", CONTACT + "contact_surface.cpp", "places_[b] = sharpPlaces(bodies_[b]);", ";",
        "collider_test", "Collider.ABlockStandsOnAllOfItsBase"),
    Bug("steps through a collider are kept", EFFECTS + "collider.cpp", "return !hasComeNear_ && !search_.isAnyPassed(way);", "return !hasComeNear_;",
        "collider_test", "FarCollider.ThatJumpsToTheOtherSideIsNotMissed"),
    Bug("steps that come near unforeseen are kept", EFFECTS + "collider.cpp", "    if (lookLate(x, begin_ + length_)) return true;", "",
        "collider_test", "FarCollider.ThatIsReachedUnforeseenIsTouchedAllTheSame"),
    Bug("smooth keys go past keys", "vdbfrac/scene/src/placement.cpp", "    if (!(a * b > 0)) return 0;", "    if (a + b == 0) return 0;",
        "scene_test", "Placement.SmoothKeysGoThroughKeysWithoutAJumpAndNeverPastThem"),
    Bug("torn faces of all bodies look alike", CORE + "drawing.cpp", "mesh.torn = torn->second;", ";",
        "laws_test", "ObjFaces.AreOfTheTornColourOfTheirBody"),
    Bug("what trembles between two tets trembles on", CONTACT + "trembling.cpp", "has(older_, p) && !has(held_, p) &&", "false && !has(held_, p) &&",
        "contact_test", "Trembling.IsWhatGoesBackToWhereItHasJustComeFrom"),
    Bug("a sample sinks past what it is held by", CONTACT + "trembling.cpp", "phi(p) < phi(last) - hidden ? p : last", "last",
        "contact_test", "Trembling.HoldsWhereASampleIsDeeperThanIsHidden"),
    Bug("lists that live on stay empty", CONTACT + "broad_phase.cpp", "wider(groups[g], -slack_)", "wider(groups[g], -3 * slack_)",
        "contact_test", "ContactSearch.ListsThatLiveOnTellWhatHasComeNear"),
    Bug("what trembles is held for ever", CONTACT + "trembling.cpp", "    std::erase_if(held_,", "    if (false) std::erase_if(held_,",
        "contact_test", "Trembling.EndsWhereASampleHasLeft"),
    Bug("what is held is not seen", CONTACT + "narrow_phase.cpp", "least = kInfinity;", ";",
        "contact_test", "Trembling.HoldsWhatASampleIsALittleOutsideOf"),
    Bug("crumbs in a body are drawn apart", EFFECTS + "contact_drawing.cpp", "out.share * beside.at(std::minmax(m.piece, m.other));", "out.share;",
        "collider_test", "DrawnPieces.StayWhereACrumbLiesInABody"),
    Bug("points are drawn out of their own piece", EFFECTS + "contact_drawing.cpp", "                out->share *= shareBack(out->way, normals[p], dx);", "",
        "collider_test", "DrawnPieces.AreNotThrownThroughThinOnes"),
    Bug("samples are made for what is far", EFFECTS + "collider.cpp", "            surface_.leave(), from_", "            surface_.settle(), from_",
        "collider_test", "FarCollider.CostsATearNoSamplesAndNoBit"),
    Bug("sharp edges are found anew after a resume", CONTACT + "contact_surface.cpp", "    restorePlaces(name, archive);\n    const", "    findPlaces();\n    const",
        "collider_test", "FarCollider.RunsGoOnWithTheSameBitsFromFarAndNear"),
    Bug("reaches are found anew after a resume", CONTACT + "contact_surface.cpp", "if (keepsReaches) r = reach[i];", ";",
        "collider_test", "FarCollider.RunsGoOnWithTheSameBitsFromFarAndNear"),
    Bug("colliders of a branch push what is in them", EFFECTS + "collider.cpp", "see(x, isFirst && isChanged_);", "see(x, false);",
        "branch_test", "Branch.CollidersThatComeOrJumpThrowNothingOut"),
    Bug("what is near within fragments is looked for whenever they move", CONTACT + "broad_phase.cpp", "frame = among_ == Among::withinFragments ?", "frame = false ?",
        "contact_test", "Contact.LooksWithinFragmentsOnlyWhereTheyDeform"),
    Bug("what may meet is not followed", CONTACT + "motion.cpp", "part = std::min(part, farthest", "part = std::max(part, farthest",
        "contact_test", "ContactSearch.SeeWhatComesFromFar"),
    Bug("what sleeps is a wall", CORE + "simulation_solve.cpp", "while (now.isSolved && wakeStruck(now.dt)) state_ = saved_, solveOver();", "if (now.isSolved) wakeStruck(now.dt);",
        "sleep_test", "Sleep.EndsInTheStepOfAPush"),
    Bug("touches hold nothing", SOLVER + "objective.cpp", "coupled ? coupled->rows() : 0", "0 * coupled->rows()",
        "linear_solver_test", "CoupledParts.AreAsFarOffAsTheirSpringHoldsThem"),
    Bug("volume that resists without what it is worth", EFFECTS + "volume.cpp", "energy += s.volume * s.k / 2 *",
        "energy += s.volume * s.k *", "volume_test", "VolumeOn.GradientIsThatOfItsEnergy"),
    Bug("tangent of volume half as stiff", EFFECTS + "volume.cpp", "std::sqrt(s.volume * s.k) *", "std::sqrt(s.volume * s.k / 2) *",
        "volume_test", "VolumeOn.TangentIsThatOfTheSquareOfWhatIsMissing"),
    Bug("loads of grips that share nodes", CORE + "grips.cpp", "sum += forceOn(held, i, time, reaction);",
        "sum += std::holds_alternative<scene::Force>(held.grip->move) ? boundary_.force[held.nodes[i]] : reaction[held.nodes[i]];",
        "laws_test", "Grips.EachTellsItsOwnLoad"),
    Bug("later stages forget how far a step has slipped on a collider", EFFECTS + "collider.cpp",
        "if (isFirst) {", "{", "collider_test", "SlidingFriction.SticksAlikeUnderEachScheme"),
    Bug("later stages forget how far a step has slipped", EFFECTS + "contact.cpp",
        "anchor_.empty() ? search_.start() : std::span<const Vec3>(anchor_)", "search_.start()",
        "collider_test", "SlidingFriction.SticksAlikeUnderEachScheme"),
    Bug("a collider's work by its last force", EFFECTS + "collider.cpp",
        "brought += .5 * forceOf(t).dot(to(t) -", "brought += forceOf(t).dot(to(t) -",
        "collider_test", "Collider.WorkOfOneThatMovesIsThatOfItsForcesOnTheWay"),
    Bug("meshes inside out stay so", "tetmesh/skin/src/winding.cpp", "isTurned[f] = 1;", "continue;",
        "skin_test", "SkinWinding.MeshesInsideOutAreTurned"),
    Bug("touches that a solve ends are forgotten", CONTACT + "narrow_phase.cpp", "lost.begin(), lost.end(), std::back_inserter(all)", "lost.begin(), lost.begin(), std::back_inserter(all)",
        "contact_test", "NarrowPhase.KeepsWhatASolveHasPushedOut"),
    Bug("energy of a touch jumps where its tet is crushed", "vdbfrac/contact/src/targets.cpp", "kNone = 1e-3;", "kNone = kFlat;",
        "contact_test", "Contact.PiecesOfABrokenSlabStayApart"),
    Bug("what a cut makes deeper pushes", "vdbfrac/contact/include/vdbfrac/contact/contact_surface.h", "allowance += now - depth;", "allowance += 0;",
        "contact_test", "ClosedLips.ForgiveWhatACutMakesDeeper"),
    Bug("what comes in by a side is pushed", EFFECTS + "contact.cpp", "std::min(depthAtStart(p), reach)", "0.",
        "contact_test", "OnLattice.EnergyOfACollisionDoesNotGrow"),
    Bug("works of contact leave gaps", EFFECTS + "contact.cpp", "forces_.contacts(pairsAt(x), x)", "contactsAt(x)",
        "contact_test", "OnLattice.WorksOfATouchThatIsOverAddUpToNothing"),
    Bug("slivers of finer lattices ride with anyone", CORE + "refine.cpp", "    spreadAnchors(mesh, isKnown, anchors);\n", "",
        "branch_test", "Finer.HalvesOfANotchedStripThatHavePartedDoNotPullAtEachOther"),
    Bug("what is cut goes on sleeping", CORE + "simulation.cpp", "if (!asleep_.empty()) wakeRecut(body, update);", "",
        "sleep_test", "Sleep.EndsWithACut"),
    Bug("what gets weaker goes on sleeping", EFFECTS + "sleep.cpp", "std::ranges::fill(asleep, 0);", "(void)asleep;",
        "sleep_test", "Sleep.EndsWhereMaterialGetsWeaker"),
    Bug("what is struck as it falls asleep is a wall", EFFECTS + "sleep.cpp", "} else if (isPushed(states[f].push, quiet.push, states[f])) {", "} else if (quiet.known && isPushed(states[f].push, quiet.push, states[f])) {",
        "sleep_test", "Sleep.EndsWithAPushInItsFirstStep"),
    Bug("fine skin folds over rims that have moved", "tetmesh/skin/src/skin_cut.cpp", "if (!made.empty()) {", "if (made.size() > ~0u) {",
        "skin_test", "SkinCut.ClosedLipsOfAJaggedCrackHaveSmoothRims"),
    Bug("skin is creased where it is going to tear", CORE + "before_cracks.cpp", "if (frame < p.until) ofPoints", "if (frame + 1 == 0) ofPoints",
        "point_cache_test", "PointCaches.LieInTheMaterialUntilTheCrackComes"),
    Bug("points stay with pieces that have gone", CORE + "point_cache.cpp", "parted.spanning(at, x)", "{}",
        "point_cache_test", "PointCachesOf.SpanNoGap"),
    Bug("closed lips are open in point caches", CORE + "taken_faces.cpp", "side < 6 && lipsClosed", "side < 0 && lipsClosed",
        "point_cache_test", "PointCachesOf.SpanNoGap"),
    Bug("stretched skin is taken for a gap", CORE + "taken_faces.cpp", "kLong * stretchAlong(rest[a], rest[b], x) * then", "kLong * then",
        "point_cache_test", "PointCaches.KeepSkinThatIsStretched"),
    Bug("what goes shrinks far away", CORE + "taken_faces.cpp", "frame == point.frame && frame > 0", "false",
        "point_cache_test", "PointCachesOf.SpanNoGap"),
    Bug("what is gone lies anywhere", CORE + "taken_faces.cpp", "nearest[all] != kNoSource ? nearest[all] : all", "all",
        "point_cache_test", "PointCachesOf.SpanNoGap"),
    Bug("what cracks take spans gaps", CORE + "taken_faces.cpp", "std::min(frame, parted.frameOf(f))", "frame",
        "point_cache_test", "PointCachesOf.SpanNoGap"),
    Bug("colliders cost wherever they are", "vdbfrac/effects/src/collider_search.cpp",
        "if (group.leastRoom(obstacles_[c], places[c]) > 0) continue;\n        pairs", "pairs",
        "collider_test", "Collider.CostsWhatIsNear"),
    Bug("friction is no load", "vdbfrac/effects/src/collider.cpp", "loads_[h.collider] +=", "(void)",
        "collider_test", "Collider.ToldLoadsAreTheWeight"),
    Bug("what spins as a whole comes nearer to itself", CONTACT + "motion.cpp", "Mat3(Mat3::Zero()) : spinOf(m)", "Mat3(Mat3::Zero()) : Mat3(Mat3::Zero())",
        "contact_test", "ContactSearch.CommonMotionListsNothingMore"),
    Bug("strength that the grid cannot hold weakens notches", FRACTURE_LAW, "if (keys.isTension && law.radius > 0) tough.perRelease", "if (!keys.strength && keys.isTension && law.radius > 0) tough.perRelease",
        "fracture_test", "BarOnset.StrengthThatTheGridCannotResolveIsSaid"),
    Bug("cracks end before the edges of solids", "tetmesh/skin/src/crack_field.cpp", "isInside(n) ? tetmesh::trilinearShare(k, t) : 0", "tetmesh::trilinearShare(k, t)",
        "skin_test", "SkinRiders.MayHaveNoMaterialLeft"),
    Bug("points at one place move apart", "tetmesh/skin/src/skin.cpp", "p < given ? riderAt[cutter_.places()[p]] : riderOf[p]", "riderOf[p]",
        "skin_test", "SkinPlaces.PointsAtOnePlaceMoveAsOne"),
    Bug("one skin joins parts that are apart at rest", "tetmesh/skin/src/skin_cut.cpp", "fragment, between_);", "fragment, {});",
        "skin_test", "SkinRiders.PartBetweenWhatIsApartAtRest"),
    Bug("lips that touch are drawn through each other", "tetmesh/skin/src/touching_lips.cpp", "return {-half * past * gap.normal,", "return {0 * half * past * gap.normal,",
        "skin_test", "PressedLips.AreDrawnOnEachOther"),
    Bug("lips far past each other are drawn on each other", "tetmesh/skin/src/touching_lips.cpp", "fading(past / dx_, kPast, kGone)", "fading(0, kPast, kGone)",
        "skin_test", "PressedLips.StayWhereTheyAreOpenOrFarPastEachOther"),
    Bug("skin stays where its rim goes", "tetmesh/skin/src/touching_lips.cpp", "for (const Beside& b : beside_) move(", "for (const Beside& b : std::span(beside_).first(0)) move(",
        "skin_test", "PressedLips.TakeTheSkinAlongThatIsNear"),
    Bug("cuts give energy to squeezed material", EFFECTS + "volume.cpp", "std::max(0., now->missing - cut.missing)", "0 * std::max(0., now->missing - cut.missing)",
        "volume_test", "Volume.GivesNoEnergyWhereMaterialTears"),
    Bug("second stages push out of where nothing has gone", EFFECTS + "contact.cpp", "before_ = isFirst_ ? std::move(now)", "before_ = true ? std::move(now)",
        "contact_test", "Contact.OfASecondStageGivesNothing"),
    Bug("the tangent resists the way material flows", SOLVER + "kernel_product.h", "f[c][i] -= rate *", "f[c][i] -= 0 * rate *",
        "kernel_test", "YieldCases.ProductIsTheDerivativeOfTheGradient"),
    Bug("half of what flows is not in the energy", SOLVER + "kernel_evaluate.cpp", "c * y * (n - y)", "0.5 * c * y * (n - y)",
        "kernel_test", "YieldCases.GradientIsTheDerivativeOfTheEnergy"),
    Bug("relaxation by backward Euler", EFFECTS + "plastic_law.cpp", "-std::expm1(-dt / relaxation)", "dt / (dt + relaxation)",
        "plasticity_test", "FlowOn.RelaxesByTheExponential"),
    Bug("hardening by another strain", EFFECTS + "plasticity.cpp", "std::sqrt(2. / 3) * std::max(0., n - after)", "std::max(0., n - after)",
        "plasticity_test", "FlowOn.AHardeningBarStaysAsLongAsItHasFlowed"),
    Bug("checkpoints forget how hard material is", EFFECTS + "plastic_state.cpp", "state.strain.values()[i] = strain[i]", "state.strain.values()[i] = 0 * strain[i]",
        "plasticity_test", "TornBar.GoesOnToTheSameBits"),
    Bug("what flows gives energy in long steps", EFFECTS + "plasticity.cpp", "boundedDilation(now, wanted, largest)) /", "wanted) /",
        "plasticity_test", "FlowOn.GivesNoEnergyInLongSteps"),
    Bug("material flows without an end", EFFECTS + "plastic_state.cpp", "return kInfinity;", "return law.yieldStrain(strain(e, t));",
        "plasticity_test", "FlowOn.EndsAtTheLargestStretch"),
    Bug("the energy of a step begins with what it has given up", CORE + "energy_accounts.cpp", "elasticEnergy_ - startEnergy + report", "report",
        "plasticity_test", "FlowOn.RelaxesByTheExponential"),
    Bug("what yields a little tears at once", EFFECTS + "fracture_driving.h", "std::max(double(works[i].atYield), energy_[i])", "double(works[i].atYield)",
        "plasticity_test", "Plasticity.CreepTearsByItsWorkAlone"),
    Bug("what has flowed tears as it did before", EFFECTS + "fracture_driving.h", "stress[t] *= std::sqrt(factors_[tetmesh::tetEntry(element, t)])", "stress[t] *= 1",
        "plasticity_test", "Plasticity.WorkOfTheFlowTearsWhatItsElasticEnergyNeverWould"),
]


def tests_in(source):
    """Names of all tests, as Suite.Name."""
    names = set()
    for file in (source / "tests").rglob("*.cpp"):
        names |= {".".join(name) for name in re.findall(r"^TEST(?:_F|_P)?\((\w+), (\w+)\)", file.read_text(), re.MULTILINE)}
    return names


def complaints(source):
    tests, programs = tests_in(source), (source / "tests/CMakeLists.txt").read_text()
    for bug in BUGS:
        count = (source / bug.file).read_text().count(bug.old)
        if count != 1:
            yield f"{bug.name}: '{bug.old}' occurs {count} times in {bug.file}"
        if bug.test not in tests:
            yield f"{bug.name}: there is no test {bug.test}"
        if f"vdbfrac_test({bug.program} " not in programs:
            yield f"{bug.name}: there is no program {bug.program}"


def copy_sources(source, copy):
    """Only what differs, so that nothing else is built again."""
    for file in list(source.rglob("*")):
        parts = file.relative_to(source).parts
        if parts[0].startswith(("build", ".")) or copy in file.parents or not file.is_file():
            continue
        to = copy.joinpath(*parts)
        if not to.exists() or to.read_bytes() != file.read_bytes():
            to.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(file, to)


def run(command, log):
    log.write(f"\n$ {' '.join(map(str, command))}\n")
    log.flush()
    return subprocess.run(command, stdout=log, stderr=subprocess.STDOUT).returncode


def build(command, folder, target, log):
    words = [word.format(build=folder, target=target) for word in command.split()]
    if run(words, log) != 0:
        sys.exit(f"{target} does not build; see {log.name}")


def plant(source, scratch, bugs, command):
    """Plants each bug and says whether its test saw it. Returns how many were missed."""
    copy, folder = scratch / "source", scratch / "source/build"
    copy_sources(source, copy)
    missed = 0
    with open(scratch / "log.txt", "w") as log:
        if run(["cmake", "-S", copy, "-B", folder, "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release", "-DVDBFRAC_TESTS=ON"], log) != 0:
            sys.exit(f"cannot configure; see {log.name}")
        for program in sorted({bug.program for bug in bugs}):
            build(command, folder, program, log)
            tests = ":".join(sorted({f"*{bug.test}*" for bug in bugs if bug.program == program}))
            if run([folder / "tests" / program, "--gtest_filter=" + tests], log) != 0:
                sys.exit(f"{program}: a test fails without any bug; see {log.name}")
        for bug in bugs:
            file = copy / bug.file
            sound = file.read_text()
            file.write_text(sound.replace(bug.old, bug.new))
            try:
                build(command, folder, bug.program, log)
                seen = run([folder / "tests" / bug.program, f"--gtest_filter=*{bug.test}*"], log) != 0
            finally:
                file.write_text(sound)
            print(f"{bug.name:44}  {bug.test:100}  {'seen' if seen else 'MISSED'}", flush=True)
            missed += not seen
    return missed


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--build-command", default="cmake --build {build} --target {target}")
    parser.add_argument("source", type=pathlib.Path)
    parser.add_argument("scratch", type=pathlib.Path, nargs="?")
    parser.add_argument("names", nargs="*")
    options = parser.parse_args()
    source = options.source.resolve()
    wrong = list(complaints(source))
    if wrong:
        sys.exit("\n".join(wrong))
    if options.check:
        return 0
    if not options.scratch:
        parser.error("a scratch folder is needed")
    unknown = set(options.names) - {bug.name for bug in BUGS}
    if unknown:
        parser.error(f"no such bug: {', '.join(sorted(unknown))}")
    options.scratch.mkdir(parents=True, exist_ok=True)
    bugs = [bug for bug in BUGS if not options.names or bug.name in options.names]
    missed = plant(source, options.scratch.resolve(), bugs, options.build_command)
    print(f"{len(bugs)} planted, {missed} missed")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
