// Work done beside the caller's, by one more thread, in the order in which it was handed over.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>

namespace vdbfrac {

class BackgroundQueue {
public:
    /// At most `depth` jobs wait; one more may be at work.
    explicit BackgroundQueue(std::size_t depth);
    /// Does all that was handed over. An error that nobody has heard of by then is lost: call finish.
    ~BackgroundQueue();
    BackgroundQueue(const BackgroundQueue&) = delete;
    BackgroundQueue& operator=(const BackgroundQueue&) = delete;

    /// Hands a job over; waits while the queue is full. Throws what an earlier job threw; after an error the jobs that
    /// wait are dropped.
    void push(std::function<void()> job);
    /// Waits until all is done; throws what a job threw.
    void finish();

    double secondsWorked() const;  ///< that the jobs took
    double secondsWaited() const;  ///< that push and finish made their callers wait

private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace vdbfrac
