#include "page_files.h"

// The assembler puts them into the program: as C++ arrays they would take the compiler minutes.
#define VDBFRAC_FILE(name, file)                                                                \
    asm(".pushsection .rodata\n" #name "_begin:\n.incbin \"" VDBFRAC_PAGE "/" file "\"\n" #name \
        "_end:\n.byte 0\n"                                                                      \
        ".popsection\n.global " #name "_begin, " #name "_end");                                 \
    extern "C" const char name##_begin[], name##_end[];

VDBFRAC_FILE(vdbfrac_page_html, "page.html")
VDBFRAC_FILE(vdbfrac_page_css, "page.css")
VDBFRAC_FILE(vdbfrac_plots_js, "plots.js")
VDBFRAC_FILE(vdbfrac_player_js, "player.js")
VDBFRAC_FILE(vdbfrac_page_js, "page.js")
VDBFRAC_FILE(vdbfrac_three_js, "three.js")

namespace vdbfrac::report {

std::string_view pageHtml() { return {vdbfrac_page_html_begin, vdbfrac_page_html_end}; }
std::string_view pageStyle() { return {vdbfrac_page_css_begin, vdbfrac_page_css_end}; }
std::string pageScript()
{
    return std::string(vdbfrac_plots_js_begin, vdbfrac_plots_js_end)
        .append(vdbfrac_player_js_begin, vdbfrac_player_js_end)
        .append(vdbfrac_page_js_begin, vdbfrac_page_js_end);
}

std::string_view threeScript() { return {vdbfrac_three_js_begin, vdbfrac_three_js_end}; }

}  // namespace vdbfrac::report
