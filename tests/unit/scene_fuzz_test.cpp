// Any bytes are a scene or an input error.
#include "scene_equality.h"
#include "scene_texts.h"

#include <random>

namespace vdbfrac::scene {
namespace {

using namespace test;

/// A Scene or an InputError; all else escapes.
void readAny(const std::string& text)
{
    try {
        const Scene scene = parse(text);
        (void)writeScene(scene, kVocabulary);
    } catch (const InputError& e) {
        EXPECT_FALSE(e.details().empty());
    }
}

TEST(SceneFuzz, AnyChangedBytesAreASceneOrAnInputError)
{
    std::mt19937 random(1);
    const std::string pieces = "[]{}\"'=.,#\n\r\t\0\\_-+0123456789einfatruex\xff\xc3\xef\xbb";
    for (int i = 0; i < 2000; ++i) {
        std::string text = i % 2 ? kRich : kGood;
        const int changes = 1 + int(random() % 4);
        for (int c = 0; c < changes; ++c) {
            const std::size_t at = random() % text.size();
            const char byte = random() % 2 ? pieces[random() % pieces.size()] : char(random() % 256);
            if (random() % 3 == 0)
                text.insert(at, 1, byte);
            else if (random() % 2)
                text[at] = byte;
            else
                text.erase(at, random() % 8);
        }
        readAny(text);
    }
}

TEST(SceneFuzz, AnyTruncationIsASceneOrAnInputError)
{
    for (std::size_t length = 0; length <= kRich.size(); ++length) readAny(kRich.substr(0, length));
}

TEST(SceneFuzz, HostileTextsAreInputErrors)
{
    constexpr std::size_t kMany = 1 << 20;
    const auto repeated = [](const std::string& piece, std::size_t bytes) {
        std::string text;
        while (text.size() < bytes) text += piece;
        return text;
    };
    const std::vector<std::string> texts = {std::string(10, '\0'),
                                            std::string("a = \"\0\"", 7),
                                            "\xff\xfe",
                                            "\xef\xbb\xbf",
                                            "a = " + std::string(kMany, '['),
                                            "a = " + repeated("{a=", kMany),
                                            "a = " + repeated("[{a=", kMany),
                                            repeated("a.", kMany) + "a = 1",
                                            "[" + repeated("a.", kMany) + "a]",
                                            "[[" + repeated("a.", kMany) + "a]]",
                                            "a = {" + repeated("\"b\" . ", kMany) + "a = 1}",
                                            std::string(kMany, 'a'),
                                            "a = " + std::string(kMany, '1'),
                                            "a = \"" + std::string(kMany, 'x') + "\"",
                                            "a = [" + repeated("0,", kMany) + "]",
                                            repeated("[[body]]\n", kMany / 8),
                                            "body = [" + repeated("1,", kMany) + "]",
                                            "name = \"\"\"a\"\"\"\"\"\n",
                                            "''''''.''.a = 1",
                                            "a = '''\\'''",
                                            std::string(kMany, '#'),
                                            std::string(kMany, '"'),
                                            std::string(kMany, '\'')};
    for (const std::string& text : texts) EXPECT_FALSE(errorsOf(text).empty()) << text.substr(0, 20);
}

TEST(SceneFuzz, CharactersBeyondAsciiStandInQuotesAndCommentsOnly)
{
    const std::string mark = "\xEF\xBB\xBF";
    const std::string e = "\xC3\xA9";
    const std::string wide = "\xE3\x80\x80\xEF\xBF\xBD\xE2\xBF\xBF\xF0\x9F\x98\x80";
    const std::string label = "[pull]\nrate = 1\nlabel = ";
    EXPECT_TRUE(errorsOf(mark + "# " + e + wide + "\n" + kGood + "# " + e).empty());
    for (const std::string quote : {"\"", "'", "\"\"\"", "'''"}) {
        const Scene s = parse(kGood + label + quote + e + wide + quote + " # " + wide + "\n");
        EXPECT_EQ(s.tables[0].values.text("label"), e + wide);
        expectEqual(s, parse(writeScene(s, kVocabulary)));
    }
    EXPECT_EQ(onlyError(kGood + "[pull]\n\"" + e + "\" = 1\nrate = 1\n", "dir/s.toml:21:1").hint, "");
    onlyError("a" + e + " = 1\n" + kGood, "dir/s.toml:1:2");
    onlyError(kGood + label + e + "\n", "dir/s.toml:22:9");
    for (const std::string gap : {"", " ", "\n  "})
        EXPECT_EQ(errorsOf(kGood + label + "\"\"\"a\\" + gap + e + "\"\"\"\n").size(), 1u);
    EXPECT_EQ(parse(kGood + label + "\"\"\"" + e + "\\\n  b\"\"\"\n").tables[0].values.text("label"), e + "b");
}

TEST(SceneFuzz, DotsInStringsAndCommentsAreNoDeepKeys)
{
    const std::string dots = "a.b.c.d.e.f.g.h.i.j.k.l.m.n.o.p.q.r.s.t.u.v.w.x.y.z";
    EXPECT_TRUE(errorsOf("# " + dots + "\n" + kGood + "[pull]\nrate = 1\nlabel = \"\\\"" + dots + "\"\n").empty());
    EXPECT_TRUE(errorsOf(kGood + "[pull]\nrate = 1\nlabel = '''\n" + dots + "'''\n").empty());
    onlyError("\n  " + dots + " = 1", "dir/s.toml:2:34");
}

}  // namespace
}  // namespace vdbfrac::scene
