// Checked values of one table of a scene, by key.
#pragma once

#include <vdbfrac/base/vec.h>
#include <vdbfrac/scene/curve.h>

#include <map>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace vdbfrac::scene {

/// Defaults are filled in. Asking for a key of another type is an assertion.
class Values {
public:
    using Range = std::pair<long long, long long>;
    using Value = std::variant<bool, long long, double, std::string, Vec3, Range, std::vector<std::string>, Curve,
                               std::vector<Values>>;

    bool has(const std::string& key) const { return values_.count(key) != 0; }  ///< set, or has a default
    bool boolean(const std::string& key) const { return std::get<bool>(values_.at(key)); }
    long long integer(const std::string& key) const { return std::get<long long>(values_.at(key)); }
    double number(const std::string& key) const { return std::get<double>(values_.at(key)); }
    const std::string& text(const std::string& key) const { return std::get<std::string>(values_.at(key)); }
    Vec3 vector(const std::string& key) const { return std::get<Vec3>(values_.at(key)); }
    Range range(const std::string& key) const { return std::get<Range>(values_.at(key)); }
    const std::vector<std::string>& list(const std::string& key) const
    {
        return std::get<std::vector<std::string>>(values_.at(key));
    }
    const Curve& curve(const std::string& key) const { return std::get<Curve>(values_.at(key)); }
    const std::vector<Values>& tables(const std::string& key) const
    {
        return std::get<std::vector<Values>>(values_.at(key));
    }
    void set(const std::string& key, Value value) { values_[key] = std::move(value); }
    /// Adds to the tables of a key.
    void append(const std::string& key, Values table)
    {
        std::get<std::vector<Values>>(values_.at(key)).push_back(std::move(table));
    }
    const std::map<std::string, Value>& all() const { return values_; }
    bool operator==(const Values& other) const { return values_ == other.values_; }

private:
    std::map<std::string, Value> values_;
};

}  // namespace vdbfrac::scene
