// How the members of structs are kept in Values. Part of key.h.
#pragma once

#include <vdbfrac/scene/key.h>

#include <filesystem>
#include <type_traits>

namespace vdbfrac::scene {

/// The name of what a choice stands for.
const std::string& choiceName(const Key& key, long long value);
/// What a name stands for; none for a name that is no choice.
std::optional<long long> choiceValue(const Key& key, const std::string& name);

template <class T>
struct OptionalOf : std::false_type {
    using Item = T;
};
template <class T>
struct OptionalOf<std::optional<T>> : std::true_type {
    using Item = T;
};

template <class T>
inline constexpr bool isListOfStructs = false;
template <class T>
inline constexpr bool isListOfStructs<std::vector<T>> = !std::is_same_v<T, std::string>;

template <class T>
constexpr Type typeOf()
{
    if constexpr (OptionalOf<T>::value) return typeOf<typename OptionalOf<T>::Item>();
    if constexpr (std::is_same_v<T, bool>) return Type::boolean;
    if constexpr (std::is_same_v<T, double>) return Type::number;
    if constexpr (std::is_same_v<T, Vec3>) return Type::vector;
    if constexpr (std::is_same_v<T, Curve>) return Type::curve;
    if constexpr (std::is_enum_v<T>) return Type::choice;
    if constexpr (isListOfStructs<T>) return Type::tables;
    if constexpr (std::is_same_v<T, std::vector<std::string>>) return Type::texts;
    return std::is_same_v<T, int> ? Type::integer : Type::text;
}

/// A member as Values keep it.
template <class T>
std::optional<Values::Value> kept(const Key& key, const T& member)
{
    if constexpr (OptionalOf<T>::value) {
        return member ? kept(key, *member) : std::nullopt;
    } else if constexpr (isListOfStructs<T>) {
        std::vector<Values> tables;
        for (const auto& entry : member) tables.push_back(valuesOf(entry, key.table->keys));
        return tables;
    } else if constexpr (Meaning<T>) {
        if (key.type() == Type::choice) return choiceName(key, static_cast<long long>(member));
        return static_cast<bool>(member);
    } else if constexpr (std::is_same_v<T, int>) {
        return static_cast<long long>(member);
    } else if constexpr (std::is_same_v<T, std::filesystem::path>) {
        return member.string();
    } else {
        if constexpr (std::is_same_v<T, std::string>)
            if (member.empty() && key.isOptional()) return {};
        return member;
    }
}

template <class T>
void restore(const Key& key, T& member, const Values::Value& value)
{
    if constexpr (OptionalOf<T>::value) {
        restore(key, member.emplace(), value);
    } else if constexpr (isListOfStructs<T>) {
        member.clear();
        for (const Values& entry : std::get<std::vector<Values>>(value))
            fill(member.emplace_back(), key.table->keys, entry);
    } else if constexpr (Meaning<T>) {
        if (const bool* given = std::get_if<bool>(&value))
            member = static_cast<T>(*given);
        else if (const auto meaning = choiceValue(key, std::get<std::string>(value)))
            member = static_cast<T>(*meaning);
    } else if constexpr (std::is_same_v<T, int>) {
        member = static_cast<int>(std::get<long long>(value));
    } else if constexpr (std::is_same_v<T, std::filesystem::path>) {
        member = std::get<std::string>(value);
    } else {
        member = std::get<T>(value);
    }
}

template <class S, class T>
class MemberAccess : public AccessIn<S> {
public:
    explicit MemberAccess(T S::*member) : member_(member) {}
    std::optional<Values::Value> get(const Key& key, const S& object) const override
    {
        return kept(key, object.*member_);
    }
    void set(const Key& key, S& object, const Values::Value& value) const override
    {
        restore(key, object.*member_, value);
    }

private:
    T S::*member_;
};

template <class S>
class RangeAccess : public AccessIn<S> {
public:
    RangeAccess(int S::*first, int S::*last) : first_(first), last_(last) {}
    std::optional<Values::Value> get(const Key&, const S& object) const override
    {
        return Values::Range(object.*first_, object.*last_);
    }
    void set(const Key&, S& object, const Values::Value& value) const override
    {
        const auto [first, last] = std::get<Values::Range>(value);
        object.*first_ = static_cast<int>(first);
        object.*last_ = static_cast<int>(last);
    }

private:
    int S::*first_;
    int S::*last_;
};

template <class S, class T>
Member::Member(T S::*member) : Member(typeOf<T>(), member)
{
}

template <class S, class T>
Member::Member(Type t, T S::*member) : type(t), access(std::make_shared<MemberAccess<S, T>>(member))
{
}

template <class S>
Member::Member(int S::*first, int S::*last) : type(Type::range), access(std::make_shared<RangeAccess<S>>(first, last))
{
}

}  // namespace vdbfrac::scene
