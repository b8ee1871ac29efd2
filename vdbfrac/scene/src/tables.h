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
        single,    ///< [name]; all defaults where it is left out
        optional,  ///< [name], or nothing of it
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
const TableSpec& study();

/// The eight above in the order in which they are written.
std::span<const Section> sections();

/// Inner tables.
std::span<const TableSpec> solids();  ///< indexed by Primitive::Kind
const TableSpec& meshFile();
const TableSpec& vdbFile();
std::span<const TableSpec> motions();  ///< indexed like Grip::move
const TableSpec& pose();
const TableSpec& series();
const TableSpec& tied();
const TableSpec& measure();

/// What a quantity of [[study.measure]] needs and what it may have besides name, exact, source, scale and order.
struct Quantity {
    const char* name;
    std::vector<const char*> needs;
    std::vector<const char*> takes = {};
};
std::span<const Quantity> quantities();

std::vector<std::string> namesOf(std::span<const TableSpec> specs);
std::vector<std::string> namesOf(std::span<const Key> keys);

}  // namespace vdbfrac::scene::tables
