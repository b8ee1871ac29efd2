// Checked values of one table of a scene, by key.
#pragma once

#include <vdbfrac/base/error.h>
#include <vdbfrac/base/vec.h>
#include <vdbfrac/scene/curve.h>

#include <map>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace vdbfrac::scene {

/// Defaults are filled in where it was read. Asking for a key that is not there, or of another type, is an Error.
class Values {
public:
    using Range = std::pair<long long, long long>;
    using Value = std::variant<bool, long long, double, std::string, Vec3, Range, std::vector<std::string>, Curve,
                               std::vector<Values>>;

    bool has(const std::string& key) const { return values_.count(key) != 0; }  ///< set, or has a default
    bool boolean(const std::string& key) const { return get<bool>(key); }
    long long integer(const std::string& key) const { return get<long long>(key); }
    double number(const std::string& key) const { return get<double>(key); }
    const std::string& text(const std::string& key) const { return get<std::string>(key); }
    Vec3 vector(const std::string& key) const { return get<Vec3>(key); }
    Range range(const std::string& key) const { return get<Range>(key); }
    const std::vector<std::string>& list(const std::string& key) const { return get<std::vector<std::string>>(key); }
    const Curve& curve(const std::string& key) const { return get<Curve>(key); }
    const std::vector<Values>& tables(const std::string& key) const { return get<std::vector<Values>>(key); }
    /// Of the tables of a key, where there are any, the one with this `name`; else itself.
    const Values& named(const std::string& key, const std::string& name) const
    {
        if (has(key))
            for (const Values& table : tables(key))
                if (table.text("name") == name) return table;
        return *this;
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
    template <class T>
    const T& get(const std::string& key) const
    {
        const auto it = values_.find(key);
        const T* const value = it == values_.end() ? nullptr : std::get_if<T>(&it->second);
        if (!value) throw Error("a table of a scene has no value of this type for '" + key + "'");
        return *value;
    }

    std::map<std::string, Value> values_;
};

}  // namespace vdbfrac::scene
