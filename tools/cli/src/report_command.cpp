// vdbfrac report: a page on a run or a wedge.
#include "number_options.h"
#include "options.h"
#include "report_files.h"

#include <vdbfrac/base/parallel.h>
#include <vdbfrac/cli/commands.h>

#include <cstdio>
#include <filesystem>

namespace vdbfrac::cli {

Action addReport(CLI::App& app)
{
    struct Options {
        std::string folder, file;
        int threads = 0;
        ReportOptions report;
    };
    auto o = std::make_shared<Options>();
    CLI::App* c = app.add_subcommand(
        "report", "One HTML page on a run, or on a wedge: curves, pictures, and an interactive 3-D player");
    c->add_option("DIR", o->folder, "Folder that 'vdbfrac sim -o' or 'vdbfrac wedge -o' wrote")->required();
    c->add_option("-o,--output", o->file, "The page (default: DIR/report.html)")
        ->type_name("FILE.html")
        ->check([](const std::string& file) {
            return std::filesystem::path(file).extension() == ".html" ? "" : "the page is an .html file";
        });
    c->add_option("--megabytes", o->report.megabytes,
                  "Size of the frames to play in the page; where all of them take more, some are left out; 0: none")
        ->check(CLI::Range(0., 1000.))
        ->capture_default_str();
    c->add_option("--pictures", o->report.pictures, "Pictures on the contact sheet; 0: none")
        ->check(CLI::Range(0, 64))
        ->capture_default_str();
    addThreads(*c, o->threads);
    return [o] {
        const ThreadLimit threads(o->threads);
        std::printf("%s\n", writeReport(o->folder, o->report, o->file).c_str());
        return kDone;
    };
}

}  // namespace vdbfrac::cli
