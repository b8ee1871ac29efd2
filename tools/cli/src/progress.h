// Progress of a run: a bar that redraws itself on a terminal, one line a frame elsewhere.
#pragma once

#include <chrono>
#include <deque>
#include <string>

namespace vdbfrac::cli {

class Progress {
public:
    /// `mode`: auto (bar on a terminal, else plain), bar, plain, none; openjd or alf: lines on standard output that
    /// render managers understand (Open Job Description; Alfred and Tractor). `total`: frames in all; `begun`: of them
    /// done before.
    Progress(const std::string& mode, int total, int begun);
    ~Progress();
    Progress(const Progress&) = delete;
    Progress& operator=(const Progress&) = delete;

    /// `done` of the total, counted in frames and parts of a frame; `detail` is shown behind.
    void update(double done, const std::string& detail);
    /// A line that stays, for the end of a frame.
    void frame(int frame, double done, const std::string& detail);

private:
    /// How fast the last frames were, and how long the others take at that.
    std::string status(double done) const;

    enum class Mode { none, plain, bar, openjd, alf } mode_;
    using Clock = std::chrono::steady_clock;
    struct Mark {
        Clock::time_point time;
        double done;
    };

    double total_;
    std::deque<Mark> marks_;  // the start, and then the ends of the last frames
    Clock::time_point drawn_{};
    bool open_ = false;  // a bar stands on the line
};

/// "4.2 s", "3 min 05 s", "2 h 10 min".
std::string duration(double seconds);

}  // namespace vdbfrac::cli
