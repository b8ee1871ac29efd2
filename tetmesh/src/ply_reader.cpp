#include "text_reader.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <vector>

namespace vdbfrac::tetmesh {

namespace {

enum class Encoding { text, little, big };

struct Type {
    std::string_view name, otherName;
    std::size_t bytes;
    enum class Kind { signedInteger, unsignedInteger, real } kind;
};
constexpr std::array<Type, 8> kTypes{{{"char", "int8", 1, Type::Kind::signedInteger},
                                      {"uchar", "uint8", 1, Type::Kind::unsignedInteger},
                                      {"short", "int16", 2, Type::Kind::signedInteger},
                                      {"ushort", "uint16", 2, Type::Kind::unsignedInteger},
                                      {"int", "int32", 4, Type::Kind::signedInteger},
                                      {"uint", "uint32", 4, Type::Kind::unsignedInteger},
                                      {"float", "float32", 4, Type::Kind::real},
                                      {"double", "float64", 8, Type::Kind::real}}};

struct Property {
    std::string name;
    Type type;
    bool isList = false;
    Type countType{};
};

struct Element {
    std::string name;
    std::size_t count = 0;
    std::vector<Property> properties;
};

struct Header {
    Encoding encoding = Encoding::text;
    std::vector<Element> elements;
};

Type type(TextReader& in)
{
    const std::string_view name = in.word();
    for (const Type& t : kTypes)
        if (name == t.name || name == t.otherName) return t;
    in.fail("unknown type '" + TextReader::shown(name) + "'", "char uchar short ushort int uint float double");
}

Encoding encoding(TextReader& in)
{
    const std::string_view name = in.word();
    if (name == "ascii") return Encoding::text;
    if (name == "binary_little_endian") return Encoding::little;
    if (name == "binary_big_endian") return Encoding::big;
    in.fail("unknown format '" + TextReader::shown(name) + "'", "ascii, binary_little_endian, binary_big_endian");
}

Property property(TextReader& in)
{
    Property p;
    const std::string_view rest = in.restOfLine();
    p.isList = rest.find_first_not_of(" \t") != std::string_view::npos &&
               rest.substr(rest.find_first_not_of(" \t")).starts_with("list");
    if (p.isList) {
        in.word();
        p.countType = type(in);
    }
    p.type = type(in);
    p.name = in.word();
    return p;
}

Header readHeader(TextReader& in, std::size_t fileSize)
{
    if (!in.nextLine() || in.word() != "ply") in.fail("does not begin with 'ply'", "a PLY file");
    Header header;
    while (in.nextLine()) {
        const std::string_view key = in.word();
        if (key == "end_header") return header;
        if (key == "format") {
            header.encoding = encoding(in);
        } else if (key == "element") {
            const std::string name(in.word());
            // Each one takes a byte or more, so a larger count cannot be true.
            header.elements.push_back({name, in.index(fileSize, "element count"), {}});
        } else if (key == "property") {
            if (header.elements.empty()) in.fail("a property before any element");
            header.elements.back().properties.push_back(property(in));
        } else if (!key.empty() && key != "comment" && key != "obj_info") {
            in.fail("'" + TextReader::shown(key) + "' in the header", "format, element, property, comment, obj_info");
        }
    }
    in.fail("ends within the header", "end_header");
}

/// Where values come from, one after the other.
class Values {
public:
    virtual ~Values() = default;
    virtual void beginElement() = 0;
    virtual double next(const Type& type) = 0;
    /// Upper bound of how many values can follow.
    virtual std::size_t left() const = 0;
    [[noreturn]] virtual void fail(const std::string& what, const std::string& allowed) const = 0;
};

class TextValues : public Values {
public:
    explicit TextValues(TextReader& in) : in_(in) {}
    void beginElement() override
    {
        do {
            if (!in_.nextLine()) in_.fail("the file ends before the elements its header declares");
        } while (in_.restOfLine().find_first_not_of(" \t\r") == std::string_view::npos);
    }
    double next(const Type&) override { return in_.anyNumber(); }
    std::size_t left() const override { return in_.restOfLine().size(); }
    [[noreturn]] void fail(const std::string& what, const std::string& allowed) const override
    {
        in_.fail(what, allowed);
    }

private:
    TextReader& in_;
};

class BinaryValues : public Values {
public:
    BinaryValues(std::string_view bytes, bool bigEndian, std::string file)
        : bytes_(bytes), bigEndian_(bigEndian), file_(std::move(file))
    {
    }

    void beginElement() override { ++element_; }
    double next(const Type& type) override
    {
        if (bytes_.size() - at_ < type.bytes) fail("the file ends before the elements its header declares", "");
        std::uint64_t bits = 0;
        for (std::size_t i = 0; i < type.bytes; ++i) {
            const std::size_t from = bigEndian_ ? i : type.bytes - 1 - i;
            bits = bits << 8 | static_cast<unsigned char>(bytes_[at_ + from]);
        }
        at_ += type.bytes;
        return decode(bits, type);
    }
    std::size_t left() const override { return bytes_.size() - at_; }
    [[noreturn]] void fail(const std::string& what, const std::string& allowed) const override
    {
        throw InputError({file_, "element " + std::to_string(element_) + ": " + what, allowed, ""});
    }

private:
    static double decode(std::uint64_t bits, const Type& type)
    {
        if (type.kind == Type::Kind::unsignedInteger) return double(bits);
        if (type.kind == Type::Kind::real)
            return type.bytes == 4 ? double(std::bit_cast<float>(std::uint32_t(bits))) : std::bit_cast<double>(bits);
        const int unused = 64 - int(8 * type.bytes);
        return double(std::int64_t(bits << unused) >> unused);
    }

    std::string_view bytes_;
    bool bigEndian_;
    std::string file_;
    std::size_t at_ = 0, element_ = 0;
};

/// A value that has to be a whole number in [0, below).
std::size_t whole(const Values& values, double v, std::size_t below, const char* what)
{
    if (!(v >= 0 && v < double(below) && v == std::floor(v)))
        values.fail(std::string(what) + " " + std::to_string(v), "0 to " + std::to_string(below - (below > 0)));
    return std::size_t(v);
}

/// Adds the triangles of a strip: each corner makes one with the two before it, every second the other way round. -1
/// begins a new strip. Triangles with a corner twice only lead from one place to another.
class StripReader {
public:
    StripReader(const Values& values, std::size_t points, PolygonSoup& soup)
        : values_(values), points_(points), soup_(soup)
    {
    }

    void add(double value)
    {
        constexpr double kRestartUnsigned = 4294967295;  // -1, where the type has no sign
        if (value == -1 || value == kRestartUnsigned) {
            length_ = 0;
            return;
        }
        const std::size_t c = whole(values_, value, points_, "point index"), a = last_[length_ % 2],
                          b = last_[(length_ + 1) % 2];
        if (length_ >= 2 && a != b && b != c && c != a) {
            // Of an even length, a is the older of both.
            if (length_ % 2 == 0)
                addPolygon(soup_, {a, b, c});
            else
                addPolygon(soup_, {b, a, c});
        }
        last_[length_++ % 2] = c;
    }

private:
    const Values& values_;
    std::size_t points_;
    PolygonSoup& soup_;
    std::array<std::size_t, 2> last_{};
    std::size_t length_ = 0;
};

/// What a vertex may have.
enum Attribute { kPlace, kUv, kNormal, kAttributes };
/// What a file calls the components of each; none where its vertices have no such attribute.
using AttributeNames = std::array<std::vector<std::string_view>, kAttributes>;

bool hasScalar(const Header& header, std::string_view name)
{
    return std::ranges::any_of(header.elements, [&](const Element& e) {
        return e.name == "vertex" &&
               std::ranges::any_of(e.properties, [&](const Property& p) { return !p.isList && p.name == name; });
    });
}

AttributeNames attributesIn(const Header& header)
{
    AttributeNames names;
    const auto take = [&](Attribute attribute, std::vector<std::string_view> all) {
        if (names[attribute].empty() && std::ranges::all_of(all, [&](auto name) { return hasScalar(header, name); }))
            names[attribute] = std::move(all);
    };
    take(kPlace, {"x", "y", "z"});
    take(kNormal, {"nx", "ny", "nz"});
    take(kUv, {"s", "t"});
    if (!hasScalar(header, "w")) take(kUv, {"u", "v"});  // else a velocity
    take(kUv, {"texture_u", "texture_v"});
    return names;
}

void readElement(const Element& element, Values& values, std::size_t points, PolygonSoup& soup,
                 const AttributeNames& names)
{
    const bool isVertex = element.name == "vertex", isFace = element.name == "face",
               isStrip = element.name == "tristrips";
    std::array<Vec3, kAttributes> own;
    own.fill(Vec3::Zero());
    values.beginElement();
    for (const Property& p : element.properties) {
        if (p.isList) {
            const std::size_t count = whole(values, values.next(p.countType), values.left() + 1, "list count");
            const bool corners = p.name == "vertex_indices" || p.name == "vertex_index";
            std::vector<std::size_t> polygon;
            StripReader strip(values, points, soup);
            for (std::size_t i = 0; i < count; ++i) {
                const double v = values.next(p.type);
                if (isFace && corners) polygon.push_back(whole(values, v, points, "point index"));
                if (isStrip && corners) strip.add(v);
            }
            addPolygon(soup, std::move(polygon));
        } else {
            const double v = values.next(p.type);
            for (std::size_t k = 0; isVertex && k < kAttributes; ++k)
                if (const auto at = std::ranges::find(names[k], p.name); at != names[k].end())
                    own[k][at - names[k].begin()] = v;
        }
    }
    if (!isVertex) return;
    if (!own[kPlace].allFinite()) values.fail("a coordinate that is not finite", "finite numbers");
    if (own[kPlace].cwiseAbs().maxCoeff() > TextReader::kLargest)
        values.fail("a coordinate that is too large", "numbers from -1e30 to 1e30");
    soup.points.push_back(own[kPlace]);
    if (!names[kUv].empty()) soup.uvs.push_back(own[kUv]);
    if (!names[kNormal].empty()) soup.normals.push_back(own[kNormal]);
}

std::size_t countOf(const Header& header, std::string_view name)
{
    for (const Element& e : header.elements)
        if (e.name == name) return e.count;
    return 0;
}

}  // namespace

PolygonSoup readPly(std::string_view bytes, const std::string& file)
{
    TextReader in(bytes, file);
    const Header header = readHeader(in, bytes.size());
    const AttributeNames names = attributesIn(header);
    if (names[kPlace].empty()) in.fail("the header has no vertex with x, y and z");
    TextValues text(in);
    BinaryValues binary(bytes.substr(std::min(in.position(), bytes.size())), header.encoding == Encoding::big, file);
    Values& values = header.encoding == Encoding::text ? static_cast<Values&>(text) : binary;
    const std::size_t points = countOf(header, "vertex");
    PolygonSoup soup;
    for (const Element& element : header.elements) {
        if (element.properties.empty()) continue;
        for (std::size_t i = 0; i < element.count; ++i) readElement(element, values, points, soup, names);
    }
    return soup;
}

}  // namespace vdbfrac::tetmesh
