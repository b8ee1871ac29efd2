#include "progress.h"

#include <sys/ioctl.h>
#include <unistd.h>

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
    char text[40];
    const int s = int(std::lround(seconds));
    if (seconds < 60)
        std::snprintf(text, sizeof text, "%.1f s", seconds);
    else if (s < 3600)
        std::snprintf(text, sizeof text, "%d min %02d s", s / 60, s % 60);
    else
        std::snprintf(text, sizeof text, "%d h %02d min", s / 3600, s % 3600 / 60);
    return text;
}

Progress::Progress(const std::string& mode, int total, int begun) : total_(std::max(1, total)), begun_(begun)
{
    const bool terminal = isatty(STDERR_FILENO) != 0;
    mode_ = mode == "none"                 ? Mode::none
            : mode == "bar"                ? Mode::bar
            : mode == "plain" || !terminal ? Mode::plain
                                           : Mode::bar;
}

Progress::~Progress()
{
    if (open_) std::fputs("\r\033[K", stderr);
}

std::string Progress::status(double done) const
{
    const double spent = secondsSince(start_);
    char text[80];
    const double own = done - begun_;
    if (own <= 0) return "";
    std::snprintf(text, sizeof text, "%.2f frames/s, %s left", own / spent,
                  duration(spent / own * (total_ - done)).c_str());
    return text;
}

void Progress::update(double done, const std::string& detail)
{
    if (mode_ != Mode::bar || secondsSince(drawn_) < kRedraw) return;
    drawn_ = std::chrono::steady_clock::now();
    const int filled = int(kWidth * std::clamp(done / total_, 0., 1.));
    const std::string bar = std::string(std::size_t(filled), '#') + std::string(std::size_t(kWidth - filled), '.');
    char percent[16];
    std::snprintf(percent, sizeof percent, "%3.0f %%", 100 * done / total_);
    std::string line = "[" + bar + "] " + percent + "  " + status(done) + "  " + detail;
    line.resize(std::min(line.size(), lineWidth() - 1));  // a longer one would stay on the screen
    std::fprintf(stderr, "\r\033[K%s", line.c_str());
    std::fflush(stderr);
    open_ = true;
}

void Progress::frame(int frame, double done, const std::string& detail)
{
    if (mode_ == Mode::plain) std::fprintf(stderr, "frame %d  %s  %s\n", frame, detail.c_str(), status(done).c_str());
    drawn_ = {};
    update(done, detail);
}

}  // namespace vdbfrac::cli
