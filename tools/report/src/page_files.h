// The files of page/, as they are.
#pragma once

#include <string>
#include <string_view>

namespace vdbfrac::report {

std::string_view pageHtml();
std::string_view pageStyle();
std::string pageScript();
std::string_view threeScript();

}  // namespace vdbfrac::report
