#include <vdbfrac/base/background.h>

#include <chrono>
#include <condition_variable>
#include <deque>
#include <exception>
#include <mutex>
#include <thread>
#include <utility>

namespace vdbfrac {

namespace {

using Clock = std::chrono::steady_clock;

double secondsSince(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

}  // namespace

struct BackgroundQueue::State {
    std::size_t depth;
    mutable std::mutex mutex;
    std::condition_variable changed;
    std::deque<std::function<void()>> jobs;
    bool busy = false, ending = false;
    std::exception_ptr error;
    double worked = 0, waited = 0;
    std::thread thread;

    void run();
    void work(std::unique_lock<std::mutex>& lock);
    /// Waits for a condition on behalf of a caller; throws the error of a job.
    template <class Condition>
    void wait(std::unique_lock<std::mutex>& lock, const Condition& condition)
    {
        const auto start = Clock::now();
        changed.wait(lock, [&] { return error || condition(); });
        waited += secondsSince(start);
        if (error) std::rethrow_exception(std::exchange(error, nullptr));
    }
};

void BackgroundQueue::State::run()
{
    std::unique_lock lock(mutex);
    for (;;) {
        changed.wait(lock, [&] { return ending || !jobs.empty(); });
        if (jobs.empty()) return;
        work(lock);
    }
}

void BackgroundQueue::State::work(std::unique_lock<std::mutex>& lock)
{
    std::function<void()> job = std::move(jobs.front());
    jobs.pop_front();
    busy = true;
    lock.unlock();
    const auto start = Clock::now();
    std::exception_ptr thrown;
    try {
        job();
    } catch (...) {
        thrown = std::current_exception();
    }
    job = nullptr;  // what it holds goes before anyone hears that it is done
    const double spent = secondsSince(start);
    lock.lock();
    worked += spent;
    busy = false;
    if (thrown) error = thrown, jobs.clear();
    changed.notify_all();
}

BackgroundQueue::BackgroundQueue(std::size_t depth) : state_(std::make_unique<State>())
{
    state_->depth = depth;
    state_->thread = std::thread([s = state_.get()] { s->run(); });
}

BackgroundQueue::~BackgroundQueue()
{
    {
        const std::lock_guard lock(state_->mutex);
        state_->ending = true;
    }
    state_->changed.notify_all();
    state_->thread.join();
}

void BackgroundQueue::push(std::function<void()> job)
{
    std::unique_lock lock(state_->mutex);
    state_->wait(lock, [&] { return state_->jobs.size() < state_->depth; });
    state_->jobs.push_back(std::move(job));
    state_->changed.notify_all();
}

void BackgroundQueue::finish()
{
    std::unique_lock lock(state_->mutex);
    state_->wait(lock, [&] { return state_->jobs.empty() && !state_->busy; });
}

double BackgroundQueue::secondsWorked() const
{
    const std::lock_guard lock(state_->mutex);
    return state_->worked;
}

double BackgroundQueue::secondsWaited() const
{
    const std::lock_guard lock(state_->mutex);
    return state_->waited;
}

}  // namespace vdbfrac
