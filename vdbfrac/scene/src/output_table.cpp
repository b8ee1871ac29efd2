// The table of what is written, with the grids that the vocabulary brings.
#include "complaints.h"
#include "tables.h"

namespace vdbfrac::scene::tables {

namespace {

std::vector<Key> outputKeys(const Vocabulary& vocabulary)
{
    const Vocabulary::Fields& fields = vocabulary.fields;
    std::vector<Choice> all(fields.rest.begin(), fields.rest.end());
    all.insert(all.end(), fields.deformed.begin(), fields.deformed.end());
    std::vector<Key> keys = {
        {.name = "vdb",
         .member = {Type::choices, &scene::Output::vdb},
         .doc = "Grids written each frame: " + joined(fields.rest, "and") + " at rest, " +
                joined(fields.deformed, "and") + " as deformed.",
         .choices = all},
        {.name = "obj",
         .member = &scene::Output::obj,
         .doc = "Whether the deformed surface is written as .obj each frame."},
        {.name = "ply",
         .member = &scene::Output::ply,
         .doc = "Whether it is written as .ply each frame, with velocities, places at rest, and the value of each grid "
                "of vdb that is one at rest."},
        {.name = "motion",
         .member = &scene::Output::motion,
         .doc = "Whether the positions of all nodes are written each frame, for 'vdbfrac embed'."},
        {.name = "point_cache",
         .member = {Type::choices, &scene::Output::pointCache},
         .doc =
             "After the last frame, the surface with one topology over all frames, as 'vdbfrac embed' makes it: mdd, "
             "an .obj with an .mdd and an .mtl, or usda. Writes the positions of nodes too.",
         .choices = {Choice("mdd"), Choice("usda")}},
        {.name = "lips",
         .member = {Type::choice, &scene::Output::lipsClosed},
         .doc = "Where both sides of a crack are drawn: closed, at the middle of the gap that the crack has made, "
                "so that it opens from nothing; or as_simulated, with the gap.",
         .choices = {{"closed", true}, {"as_simulated", false}}},
        {.name = "torn_detail",
         .member = &scene::Output::tornDetail,
         .unit = "m",
         .doc =
             "How far torn faces are moved by noise, as roughness that the voxels do not resolve; none at their rims.",
         .min = 0},
        {.name = "torn_detail_size",
         .member = &scene::Output::tornDetailSize,
         .unit = "m",
         .doc = "Size of the largest features of that noise; 0 takes three voxels.",
         .min = 0},
        {.name = "torn_detail_seed",
         .member = &scene::Output::tornDetailSeed,
         .doc = "Another number gives other noise.",
         .min = 0,
         .max = 1e9}};
    if (vocabulary.colliders)
        keys.push_back(
            {.name = "in_colliders",
             .member = {Type::choice, &scene::Output::movedOut},
             .doc = "How surfaces that lie inside colliders are drawn: moved_out, onto the surface of the collider, "
                    "where they are no deeper than two voxels; or as_simulated.",
             .choices = {{"moved_out", true}, {"as_simulated", false}}});
    return keys;
}

}  // namespace

Output::Output(const Vocabulary& vocabulary)
    : keys_(outputKeys(vocabulary)), spec_{"output", "What is written each frame.", keys_}
{
}

}  // namespace vdbfrac::scene::tables
