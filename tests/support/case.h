// Parameters of tests that are made when a test runs.
#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <ostream>
#include <string>

namespace vdbfrac::test {

/// Something to test, and its name.
template <class T>
struct Case {
    const char* name;
    std::function<T()> make;
    friend void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }
};
template <class T>
std::string nameOf(const testing::TestParamInfo<Case<T>>& info)
{
    return info.param.name;
}

}  // namespace vdbfrac::test
