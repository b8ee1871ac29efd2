// What those above bring to a scene: fields, tables with tables in them, and rules about them.
#include "scene_texts.h"

#include <vdbfrac/scene/review.h>

#include <optional>

namespace vdbfrac::scene {
namespace {

using namespace test;

enum class Mood { calm, wild };

struct Child {
    std::string name;
    std::optional<double> weight;
    bool operator==(const Child&) const = default;
};

struct Party {
    bool loud = true;
    int guests = 3;
    double hours = 2.5;
    std::string motto = "none";
    std::string host;
    Vec3 place{1, 2, 3};
    std::optional<Vec3> way;
    Mood mood = Mood::wild;
    bool late = false;
    int first = 1, last = 9;
    std::vector<std::string> songs = {"a"};
    std::vector<Child> children, pets;
};

const Key kChild[] = {
    {.name = "name", .member = {Type::label, &Child::name}, .doc = "Name.", .defaultText = kRequired},
    {.name = "weight", .member = &Child::weight, .unit = "kg", .doc = "Weight.", .min = 0},
};

void completeChild(Review& child)
{
    child.requireNewName(child.parent().tables("child"));
    if (child.isSound && !child.values.has("weight")) child.values.set("weight", double(child.scene().bodies.size()));
}

const TableSpec kChildSpec = {.name = "party.child", .doc = "A child.", .keys = kChild, .complete = completeChild};
const TableSpec kPetSpec = {.name = "pet", .doc = "A pet.", .keys = kChild};

const Key kParty[] = {
    {.name = "loud", .member = &Party::loud, .doc = "Loud."},
    {.name = "guests", .member = &Party::guests, .doc = "Guests.", .max = 9},
    {.name = "hours", .member = &Party::hours, .doc = "Hours."},
    {.name = "motto", .member = &Party::motto, .doc = "Motto."},
    {.name = "host", .member = &Party::host, .doc = "Host.", .defaultText = kOptional},
    {.name = "place", .member = &Party::place, .doc = "Place."},
    {.name = "way", .member = {Type::direction, &Party::way}, .doc = "Way."},
    {.name = "mood", .member = &Party::mood, .doc = "Mood.", .choices = {{"calm", Mood::calm}, {"wild", Mood::wild}}},
    {.name = "when",
     .member = {Type::choice, &Party::late},
     .doc = "When.",
     .choices = {{"early", false}, {"late", true}}},
    {.name = "days", .member = {&Party::first, &Party::last}, .doc = "Days."},
    {.name = "songs", .member = &Party::songs, .doc = "Songs."},
    {.name = "child", .member = &Party::children, .doc = "Children.", .table = &kChildSpec},
    {.name = "pets", .member = {Type::entries, &Party::pets}, .doc = "Pets.", .table = &kPetSpec},
};

const Vocabulary kWithParty = {.notes = {{.name = "party", .doc = "A party.", .keys = kParty, .inner = "guests"}},
                               .fields = {{"phi", "energy", "heat"}, {"surface"}}};

Party partyOf(const Scene& scene)
{
    Party party;
    fill(party, kParty, scene.notes.at(0).values);
    return party;
}

TEST(SceneVocabulary, FieldsAreTakenWhereTheyAreKnown)
{
    const std::string output = kGood + "[output]\nvdb = [\"phi\", \"heat\"]\n";
    EXPECT_EQ(parse(output, {}, kWithParty).output.vdb, (std::vector<std::string>{"phi", "heat"}));
    const auto d = onlyError(output, "dir/s.toml:21:15");
    EXPECT_TRUE(contains(d.allowed, "\"phi\", \"energy\", \"surface\", \"vel\" and \"fragment_id\"")) << d.allowed;
    const auto heart = onlyError(kGood + "[output]\nvdb = [\"heatt\"]\n", "dir/s.toml:21:8", kWithParty);
    EXPECT_TRUE(contains(heart.allowed, "\"phi\", \"energy\", \"heat\" and \"surface\"")) << heart.allowed;
    EXPECT_EQ(heart.hint, "did you mean 'heat'?");
    EXPECT_TRUE(contains(defaultsText(kWithParty), "phi, energy and heat at rest, surface as deformed"));
    EXPECT_TRUE(contains(schemaText(kWithParty), "\"heat\""));
}

TEST(SceneVocabulary, MembersStartWithTheDefaultsOfTheirStruct)
{
    const Party read = partyOf(parse(kGood + "[party]\n", {}, kWithParty)), made;
    EXPECT_EQ(valuesOf(read, kParty), valuesOf(made, kParty));
    EXPECT_FALSE(valuesOf(made, kParty).has("host"));
    EXPECT_FALSE(valuesOf(made, kParty).has("way"));
    const std::string text = defaultsText(kWithParty);
    for (const char* line : {"#loud = true\n", "#guests = 3\n", "#hours = 2.5\n", "#motto = \"none\"\n", "#host =\n",
                             "#place = [1, 2, 3]\n", "#way =\n", "#mood = \"wild\"\n", "#when = \"early\"\n",
                             "#days = [1, 9]\n", "#songs = [\"a\"]\n", "#child = []\n", "#pets = []\n"})
        EXPECT_TRUE(contains(text, line)) << line;
}

TEST(SceneVocabulary, EveryMemberIsReadAndReadsBackAsItWasWritten)
{
    const std::string text = kGood + R"([party]
loud = false
guests = 9
hours = 0.1
motto = "m"
host = "h"
place = [0, 0, 1]
way = [0, 0, 2]
mood = "calm"
when = "late"
days = [2, 3]
songs = []
pets = [{ name = "p", weight = 2 }]
[[party.child]]
name = "c"
[[party.child]]
name = "d"
weight = 0.5
)";
    const Scene scene = parse(text, {}, kWithParty);
    const Party p = partyOf(scene);
    EXPECT_FALSE(p.loud);
    EXPECT_EQ(p.guests, 9);
    EXPECT_EQ(p.host, "h");
    EXPECT_EQ(*p.way, Vec3(0, 0, 1));
    EXPECT_EQ(p.mood, Mood::calm);
    EXPECT_TRUE(p.late);
    EXPECT_EQ(p.last, 3);
    EXPECT_TRUE(p.songs.empty());
    EXPECT_EQ(p.pets, (std::vector<Child>{{"p", 2}}));
    EXPECT_EQ(p.children, (std::vector<Child>{{"c", 1}, {"d", 0.5}}));  // there is one body

    const std::string written = writeScene(scene, kWithParty);
    EXPECT_EQ(parse(written, {}, kWithParty).notes[0].values, scene.notes[0].values) << written;
    EXPECT_EQ(valuesOf(p, kParty), scene.notes[0].values);
}

TEST(SceneVocabulary, RulesComplainAtTheirPlaces)
{
    const std::string party = kGood + "[party]\n[[party.child]]\nname = \"c\"\n[[party.child]]\nname = \"c\"\n";
    const auto d = onlyError(party, "dir/s.toml:24:8", kWithParty);
    EXPECT_EQ(d.what, "party.child.1.name is \"c\", which is taken");
    onlyError(kGood + "[party]\npets = [{ name = \"p\", wight = 2 }]\n", "dir/s.toml:21:23", kWithParty);
    onlyError(kGood + "[party]\nchild = 3\n", "dir/s.toml:21:9", kWithParty);
    EXPECT_EQ(onlyError(kGood + "[[partly]]\n", "dir/s.toml:20:3", kWithParty).hint, "did you mean 'party'?");
}

TEST(Colliders, AreSolidsOfAnyKindThatMoveAlongPaths)
{
    const Scene s = parse(kRich);
    ASSERT_EQ(s.colliders.size(), 3u);
    EXPECT_EQ(s.colliders[0].name, "collider1");
    EXPECT_EQ(s.colliders[2].name, "collider3");
    EXPECT_EQ(std::get<Velocity>(s.colliders[0].move).velocity, Vec3::Zero());
    EXPECT_EQ(std::get<MeshFile>(s.colliders[1].shape).file.filename(), "post.obj");
    const std::string collider = kGood + "[[collider]]\n";
    EXPECT_TRUE(contains(onlyError(collider, "dir/s.toml:20:1").what, "lacks the key 'shape'"));
    const auto forced = onlyError(collider + "shape.sphere.radius = 1\nmove.force = [1, 0, 0]\n", "dir/s.toml:22:6");
    EXPECT_TRUE(contains(forced.allowed, "velocity, keys"));
    EXPECT_TRUE(contains(onlyError(collider + "shape.sphere.radius = 1\nfriction = -1\n", "dir/s.toml:22:12").allowed,
                         "not less than 0"));
}

/// Where nobody knows them they are a table like any other that is unknown.
TEST(Colliders, AreUnknownWithoutAnEffectForThem)
{
    const Vocabulary none;
    EXPECT_TRUE(contains(onlyError(kGood + "[[collider]]\nshape.sphere.radius = 1\n", "dir/s.toml:20:3", none).what,
                         "unknown key \"collider\""));
    EXPECT_FALSE(contains(defaultsText(none), "collider"));
    EXPECT_FALSE(contains(schemaText(none), "\"collider\""));
    EXPECT_TRUE(contains(defaultsText(kVocabulary), "#[[collider]]"));
    EXPECT_TRUE(contains(schemaText(kVocabulary), "\"collider\""));
}

}  // namespace
}  // namespace vdbfrac::scene
