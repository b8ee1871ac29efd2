// report.html of a run or a wedge.
#pragma once

#include <chrono>
#include <filesystem>
#include <string>
#include <utility>

namespace vdbfrac::cli {

struct ReportOptions {
    double megabytes = 12;  ///< of frames to play, in a page; 0: none
    int pictures = 8;       ///< on the contact sheet; 0: none
};

/// Writes `file`, or folder/report.html where it is empty. A wedge also gets table.csv. Returns the file. Throws
/// InputError, FileError.
std::filesystem::path writeReport(const std::filesystem::path& folder, const ReportOptions& options = {},
                                  std::filesystem::path file = {});

/// The page of a run while it goes on: written anew no more often than 1 / 20 of the time allows.
class LiveReport {
public:
    explicit LiveReport(std::filesystem::path folder) : folder_(std::move(folder)) {}

    /// After a frame. Returns what went wrong; empty when nothing did.
    std::string update();
    /// Once it is over.
    std::string finish();

private:
    using Clock = std::chrono::steady_clock;

    std::filesystem::path folder_;
    Clock::time_point next_ = Clock::now();
};

}  // namespace vdbfrac::cli
