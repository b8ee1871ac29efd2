#include <vdbfrac/contact/trembling.h>

#include <algorithm>
#include <tuple>
#include <utility>

namespace vdbfrac::contact {

namespace {

bool isBefore(const Pair& a, const Pair& b) { return std::tie(a.sample, a.target) < std::tie(b.sample, b.target); }

bool has(std::span<const Pair> pairs, const Pair& pair)
{
    return std::ranges::any_of(std::ranges::equal_range(pairs, pair.sample, {}, &Pair::sample),
                               [&](const Pair& p) { return p.target == pair.target; });
}

void save(const std::string& name, std::span<const Pair> pairs, core::Archive& archive)
{
    std::vector<std::uint32_t> numbers;
    for (const Pair& p : pairs) numbers.insert(numbers.end(), {p.sample, p.target});
    archive.put(name, numbers);
}

std::vector<Pair> restored(const std::string& name, const core::Archive& archive, std::size_t samples,
                           std::size_t targets)
{
    const auto numbers = archive.get<std::uint32_t>(name);
    std::vector<Pair> pairs;
    if (numbers.size() % 2 != 0) archive.complain("'" + name + "' lacks a number");
    for (std::size_t i = 0; i < numbers.size(); i += 2) {
        pairs.push_back({numbers[i], numbers[i + 1]});
        if (numbers[i] >= samples || numbers[i + 1] >= targets) archive.complain("'" + name + "' is out of range");
    }
    if (!std::ranges::is_sorted(pairs, {}, &Pair::sample)) archive.complain("'" + name + "' is out of order");
    return pairs;
}

}  // namespace

bool Trembling::look(std::span<const Pair> seen, const ContactSurface& surface, const Targets& targets,
                     std::span<const Vec3> x, double hidden)
{
    const auto phi = [&](const Pair& p) { return targets.locate(p.target, surface.probe(p.sample, x), x).phi; };
    const std::size_t before = held_.size();
    for (const Pair& p : seen)
        for (const Pair& last : std::ranges::equal_range(last_, p.sample, {}, &Pair::sample))
            if (last.target != p.target && targets[last.target].fragment == targets[p.target].fragment &&
                has(older_, p) && !has(held_, p) && !has(held_, last)) {
                const Pair& pushes = phi(p) < phi(last) - hidden ? p : last;
                held_.insert(std::ranges::upper_bound(held_, pushes, isBefore), pushes);
            }
    return held_.size() > before;
}

void Trembling::keep(std::span<const Pair> pairs)
{
    older_ = std::exchange(last_, {pairs.begin(), pairs.end()});
    std::erase_if(held_, [&](const Pair& p) { return !has(last_, p); });
}

void Trembling::save(const std::string& name, core::Archive& archive) const
{
    contact::save(name + ".last", last_, archive), contact::save(name + ".older", older_, archive);
    contact::save(name + ".held", held_, archive);
}

void Trembling::restoreFrom(const std::string& name, const core::Archive& archive, std::size_t samples,
                            std::size_t targets)
{
    last_ = restored(name + ".last", archive, samples, targets);
    older_ = restored(name + ".older", archive, samples, targets);
    held_ = restored(name + ".held", archive, samples, targets);
}

std::size_t Trembling::bytes() const
{
    return (last_.capacity() + older_.capacity() + held_.capacity()) * sizeof(Pair);
}

}  // namespace vdbfrac::contact
