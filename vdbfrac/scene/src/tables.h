// The tables of keys of a scene. They drive reading, writing, the defaults text and the JSON schema.
#pragma once

#include <vdbfrac/scene/key.h>
#include <vdbfrac/scene/scene.h>

#include <span>
#include <string>
#include <vector>

namespace vdbfrac::scene::tables {

/// A top-level table of the scene itself (those of the vocabulary come on top).
struct Section {
    enum class Form {
        single,  ///< [name]; all defaults where it is left out
        list,    ///< [[name]]
        byName,  ///< [name.NAME]
    };
    const TableSpec& spec;
    Form form = Form::single;
    bool required = false;
};

const TableSpec& root();  ///< version, name: the keys outside of any table
const TableSpec& time();
const TableSpec& grid();
const TableSpec& body();
const TableSpec& material();
const TableSpec& grip();
const TableSpec& collider();
const TableSpec& solver();

/// The table whose choices the vocabulary brings.
class Output {
public:
    explicit Output(const Vocabulary& vocabulary);
    Output(const Output&) = delete;
    Output& operator=(const Output&) = delete;
    const TableSpec& spec() const { return spec_; }

private:
    std::vector<Key> keys_;
    TableSpec spec_;
};

/// From time to output, in the order in which they are written.
std::vector<Section> sections(const Output& output, const Vocabulary& vocabulary);

/// Inner tables.
std::span<const TableSpec> solids();  ///< indexed by Primitive::Kind
const TableSpec& meshFile();
const TableSpec& vdbFile();
std::span<const TableSpec> motions();  ///< indexed like Grip::move
const TableSpec& pose();

std::vector<std::string> namesOf(std::span<const TableSpec> specs);
std::vector<std::string> namesOf(std::span<const Key> keys);

}  // namespace vdbfrac::scene::tables
