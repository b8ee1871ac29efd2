// Scenes as text, two effects that only the tests know, and what the reader says of a text.
#pragma once

#include <vdbfrac/base/error.h>
#include <vdbfrac/scene/reader.h>

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace vdbfrac::test {

using Details = std::vector<InputError::Detail>;

inline const std::vector<scene::Key> kPullKeys = {
    {"rate", scene::Type::number, "1/s", "How fast.", nullptr, 0, 10, true},
    {"mode", scene::Type::choice, "", "How.", "\"soft\"", 0, 0, false, false, {"soft", "hard"}},
    {"limit", scene::Type::number, "N", "Where it ends.", ""},
    {"count", scene::Type::integer, "", "How often.", "3", 1},
    {"direction", scene::Type::direction, "", "Where to.", "[0, 0, 2]"},
    {"label", scene::Type::text, "", "A note.", "\"\""},
    {"on", scene::Type::boolean, "", "Whether.", "true"},
    {"keys", scene::Type::curve, "", "How much, over time.", "", 0, 5, true},
};
inline const std::vector<scene::Key> kDragKeys = {{"air", scene::Type::vector, "m/s", "Wind.", "[0, 0, 0]"}};

inline std::string checkPull(const scene::Values& v)
{
    return v.number("rate") > 5 && v.text("mode") == "hard" ? "a rate above 5 goes with mode = \"soft\" only" : "";
}

inline const scene::Vocabulary kVocabulary = {
    .tables = {{"pull", "Pulls.", kPullKeys, checkPull}, {"drag", "Drags.", kDragKeys}},
    .fields = {{"phi", "energy"}, {"surface", "vel", "fragment_id"}},
    .colliders = true};

// Line numbers in the tests below count from here.
inline const std::string kGood = R"(version = 1
name = "block"
[time]
frames = [1, 12]
fps = 25
[grid]
voxel_size = 0.05
[[body]]
name = "left"
shape = { box = { size = [1, 2, 1] } }
material = "gel"
[material.gel]
youngs_modulus = 1e5
poisson_ratio = 0.3
density = 1000
[[grip]]
body = "left"
region = { halfspace = { normal = [0, 2, 0], offset = 0.5 } }
move = { velocity = [0, 0.1, 0] }
)";

inline const std::string kRich = R"(name = "rich"
drag = { }
[time]
frames = [0, 0]
fps = 23.976
substeps = 7
node_cfl = 0.1
[grid]
voxel_size = 3.3333333333333335e-05
lattice = "five"
half_width = 10
[[body]]
name = "b \" \u00e9"
shape.mesh = { file = "../meshes/a b.obj", scale = 0.1, rotate = [0.1, 0.2, 0.3], translate = [-0.0, 1e300, 5e-324] }
add = [{ capsule = { axis = [1, 1, 1], radius = 0.1, height = 0.7 } }, { torus = { radius = 2, tube = 0.3 } }]
cut = [{ cylinder = { axis = "x", radius = 0.35, center = [0.5, 0, 0] } }, { sphere = { radius = 9007199254740993 } }]
material = "odd name"
velocity = [1, 2, 3]
angular_velocity = [0.1, 0, 0]
[[body]]
name = "c"
shape.vdb = "/data/c.vdb"
material = "a"
[[body]]
name = "d"
shape.cylinder = { axis = [3, -4, 1e-3], radius = 0.35, height = 1 }
material = "a"
[material."odd name"]
youngs_modulus = 9223372036854775807
poisson_ratio = -0.999
density = 1e-3
[material.a]
torn_colour = [1, 0.9, 0.5]
youngs_modulus = 1
poisson_ratio = 0.499999
density = 1
[[grip]]
body = "c"
region = { sphere = { radius = 1 } }
move = { keys = [{ time = 0 }, { time = 0.5, rotate = [0, 90, 0], translate = [0, 0.1, 0] }], pivot = [0, 1, 0], interpolation = "smooth" }
[[grip]]
name = "pull"
body = "d"
region.halfspace = { normal = [0.3, -0.1, 0.7], offset = -0.1 }
move = { force = [0, -10, 0], ramp = 0.25 }
[[collider]]
shape.halfspace.normal = [0, -1, 0]
[[collider]]
name = "post"
friction = 0
shape.mesh = "post.obj"
move = { keys = [{ time = 0 }, { time = 0.5, rotate = [0, 90, 0] }], pivot = [0, 1, 0] }
[[collider]]
shape.vdb = { file = "ground.vdb", grid = "earth" }
move.velocity = [0.1, 0, 0]
[pull]
rate = 2
limit = 0.1
[solver]
newton_tolerance = 1e-6
linear_solver = "direct"
volumetric = "none"
[output]
vdb = ["vel", "phi", "fragment_id"]
obj = false
)";

inline scene::Scene parse(const std::string& text, const std::vector<std::string>& overrides = {},
                          const scene::Vocabulary& vocabulary = kVocabulary)
{
    return scene::parseScene(text, "dir/s.toml", vocabulary, overrides);
}

inline Details errorsOf(const std::string& text, const std::vector<std::string>& overrides = {},
                        const scene::Vocabulary& vocabulary = kVocabulary)
{
    try {
        parse(text, overrides, vocabulary);
    } catch (const InputError& e) {
        return e.details();
    }
    return {};
}

/// kGood with one piece of text exchanged.
inline std::string with(const std::string& from, const std::string& to)
{
    std::string text = kGood;
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return text.replace(at, from.size(), to);
}

/// The only complaint of a text; its place is `place`.
inline InputError::Detail onlyError(const std::string& text, const std::string& place,
                                    const scene::Vocabulary& vocabulary = kVocabulary)
{
    const Details details = errorsOf(text, {}, vocabulary);
    EXPECT_EQ(details.size(), 1u) << text;
    if (details.empty()) return {};
    EXPECT_EQ(details[0].place, place) << details[0].what;
    return details[0];
}

inline bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

}  // namespace vdbfrac::test
