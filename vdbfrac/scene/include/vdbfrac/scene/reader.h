// Scene text (TOML) -> Scene, with every error of the text reported at once.
#pragma once

#include <vdbfrac/scene/key.h>
#include <vdbfrac/scene/scene.h>

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace vdbfrac::scene {

/// Parses and checks a scene. `file` names it in errors and resolves relative paths (against its folder).
/// `overrides` are "key.path=value" texts, values as in TOML ("grid.voxel_size=0.02",
/// "material.gel.poisson_ratio=0.49"). A step of a path is a key, the index of a list entry or the name of one:
/// "body.0.velocity=[0,1,0]", or "body.block.velocity=[0,1,0]". A value that is no TOML is taken as a text:
/// "name=strip". Throws InputError with one detail for each thing wrong: "file:line:column" (or "--set key.path"),
/// value, range, hint ("did you mean"). A syntax error, and so a duplicate key, ends the reading and is the only
/// detail.
Scene parseScene(std::string_view text, const std::filesystem::path& file, const Vocabulary& vocabulary,
                 const std::vector<std::string>& overrides = {});

/// Reads a file and parses it. Throws FileError, InputError.
Scene readScene(const std::filesystem::path& file, const Vocabulary& vocabulary,
                const std::vector<std::string>& overrides = {});

/// A scene text that parses to the same Scene: all keys written out, numbers in the shortest form that reads back to
/// the same bits, absolute paths. The vocabulary must have the tables of the scene.
std::string writeScene(const Scene& scene, const Vocabulary& vocabulary);

/// Of a scene that was filled in code: throws InputError with all that parseScene would say of it, its places being
/// lines of writeScene's text.
void requireValid(const Scene& scene, const Vocabulary& vocabulary);

/// Every key with its default, type, unit, range and sentence, as commented TOML. Required keys and optional tables
/// are commented out: with the required keys filled in it is a scene.
std::string defaultsText(const Vocabulary& vocabulary);

/// A small complete scene to start from.
std::string exampleText();

/// JSON Schema (draft-07) of a scene, for editors that check and complete TOML.
std::string schemaText(const Vocabulary& vocabulary);

}  // namespace vdbfrac::scene
