// The tables of keys of a scene. They drive reading, writing, the defaults text and the JSON schema.
#pragma once

#include <vdbfrac/scene/scene.h>

#include <span>
#include <string>
#include <vector>

namespace vdbfrac::scene::tables {

/// A top-level table of the scene itself (effects come on top).
struct Section {
    enum class Form {
        single,    ///< [name]
        list,      ///< [[name]]
        byName,    ///< [name.NAME]
    };
    TableSpec spec;
    Form form = Form::single;
    bool required = false;
};

const TableSpec& root();  ///< version, name: the keys outside of any table
const TableSpec& time();
const TableSpec& grid();
const TableSpec& body();
const TableSpec& material();
const TableSpec& grip();
const TableSpec& solver();
const TableSpec& output();

/// The seven above in the order in which they are written.
std::span<const Section> sections();

/// Inner tables.
std::span<const TableSpec> solids();  ///< indexed by Primitive::Kind
const TableSpec& meshFile();
const TableSpec& vdbFile();
std::span<const TableSpec> motions();  ///< indexed like Grip::move
const TableSpec& pose();

std::vector<std::string> namesOf(std::span<const TableSpec> specs);
std::vector<std::string> namesOf(std::span<const Key> keys);

}  // namespace vdbfrac::scene::tables
