#include "progress.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace vdbfrac::cli {

namespace {

constexpr int kWidth = 20;       // characters of the bar
constexpr double kRedraw = 0.1;  // s between two drawings

/// Characters of a line of the terminal.
std::size_t lineWidth()
{
    constexpr std::size_t kUsual = 80;
    winsize size{};
    return ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : kUsual;
}

double secondsSince(std::chrono::steady_clock::time_point t)
{
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - t).count();
}

}  // namespace

std::string duration(double seconds)
{
    const int s = int(std::lround(seconds));
    if (seconds < 60) return fmt::format("{:.1f} s", seconds);
    if (s < 3600) return fmt::format("{} min {:02} s", s / 60, s % 60);
    return fmt::format("{} h {:02} min", s / 3600, s % 3600 / 60);
}

Progress::Progress(const std::string& mode, int total, int begun)
    : total_(std::max(1, total)), marks_{{Clock::now(), double(begun)}}
{
    const bool terminal = isatty(STDERR_FILENO) != 0;
    mode_ = mode == "none"                 ? Mode::none
            : mode == "bar"                ? Mode::bar
            : mode == "openjd"             ? Mode::openjd
            : mode == "alf"                ? Mode::alf
            : mode == "plain" || !terminal ? Mode::plain
                                           : Mode::bar;
}

Progress::~Progress()
{
    if (open_) std::fputs("\r\033[K", stderr);
}

std::string Progress::status(double done) const
{
    const double spent = secondsSince(marks_.front().time), own = done - marks_.front().done;
    if (own <= 0) return "";
    return fmt::format("{:.2f} frames/s, {} left", own / spent, duration(spent / own * (total_ - done)));
}

void Progress::update(double done, const std::string& detail)
{
    if (mode_ != Mode::bar || secondsSince(drawn_) < kRedraw) return;
    drawn_ = Clock::now();
    const int filled = int(kWidth * std::clamp(done / total_, 0., 1.));
    const std::string bar = std::string(std::size_t(filled), '#') + std::string(std::size_t(kWidth - filled), '.');
    std::string line = fmt::format("[{}] {:3.0f} %  {}  {}", bar, 100 * done / total_, status(done), detail);
    line.resize(std::min(line.size(), lineWidth() - 1));  // a longer one would stay on the screen
    std::fprintf(stderr, "\r\033[K%s", line.c_str());
    std::fflush(stderr);
    open_ = true;
}

void Progress::frame(int frame, double done, const std::string& detail)
{
    const double percent = 100 * std::clamp(done / total_, 0., 1.);
    if (mode_ == Mode::openjd)
        std::printf("openjd_progress: %.1f\nopenjd_status: frame %d, %s\n", percent, frame, detail.c_str());
    if (mode_ == Mode::alf) std::printf("ALF_PROGRESS %.0f%%\n", percent);
    std::fflush(stdout);
    if (mode_ == Mode::plain) std::fprintf(stderr, "frame %d  %s  %s\n", frame, detail.c_str(), status(done).c_str());
    constexpr std::size_t kRecent = 8;  // frames: what tears takes longer than what does not yet
    marks_.push_back({Clock::now(), done});
    if (marks_.size() > kRecent) marks_.pop_front();
    drawn_ = {};
    update(done, detail);
}

}  // namespace vdbfrac::cli
