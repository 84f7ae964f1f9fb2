#include "worker/gather/allot.h"

#include <algorithm>
#include <map>

namespace bakewell {
namespace {

constexpr double kAim = 0.95;  // of the sum that is allowed: rounds for the last crumbs cost more than they bring

constexpr double kWorthSparing = 0.05;  // errors below gain too little

constexpr float kChartsSamples = 4;  // that its chart's mean counts as, beside a neighbourhood's own
constexpr float kNeighbourhoodTexels = 9;

// A claim's cost is what its samples so far have cost.
double Room(const Demand& demand) {
  double room = demand.ceiling;
  for (const Claim& claim : demand.claims) room -= static_cast<double>(claim.cost);
  return room;
}

bool MayGoOn(const Claim& claim, double room) {
  if (!(claim.error > 0)) return false;
  return claim.doublings > 0 || (claim.further > 0 && static_cast<double>(claim.cost) <= room);
}

// Beyond what one texel may have, what can get no more samples is nobody else's to make up for.
double Counted(const Claim& claim, double room) {
  const double error = static_cast<double>(claim.weight) * static_cast<double>(claim.error);
  return MayGoOn(claim, room) ? error : std::min(error, 1.0);
}

}  // namespace

std::vector<bool> Allot(const Demand& demand, double& spare) {
  struct Next {
    double error, worst, cost;  // error: in the sum; beyond `worst` it is urgent
    int doublings, further;
    size_t claim;
    bool Urgent() const { return doublings > 0 && error > worst; }
    // The last of a heap is granted first.
    bool operator<(const Next& other) const {
      if (Urgent() != other.Urgent()) return other.Urgent();
      const double gain = error * other.cost, other_gain = other.error * cost;
      return gain != other_gain ? gain < other_gain : claim > other.claim;
    }
  };
  const std::vector<Claim>& claims = demand.claims;
  std::vector<bool> granted(claims.size(), false);
  double sum = 0, room = Room(demand);
  std::vector<Next> heap;
  for (size_t i = 0; i < claims.size(); ++i) {
    const Claim& claim = claims[i];
    sum += Counted(claim, room);
    const auto weight = static_cast<double>(claim.weight);
    if (MayGoOn(claim, room)) {
      heap.push_back({weight * static_cast<double>(claim.error), weight * static_cast<double>(kWorst * kWorst),
                      claim.cost, claim.doublings, claim.further, i});
    }
  }
  std::make_heap(heap.begin(), heap.end());
  // All doublings that the whole will take, as far as can be told: who has none of them waits.
  const double allowed = static_cast<double>(demand.texels);
  const bool enough = sum <= allowed;
  while (!heap.empty() && (heap.front().Urgent() || (!enough && sum > kAim * allowed))) {
    std::pop_heap(heap.begin(), heap.end());
    Next next = heap.back();
    heap.pop_back();
    const double before = next.error;
    if (next.doublings > 0 || next.cost <= room) {
      granted[next.claim] = true;
      room -= next.cost;
      next.error *= 0.5;
      next.cost *= 2;
      --(next.doublings > 0 ? next.doublings : next.further);
    } else {
      next.further = 0;
    }
    const bool goes_on = next.doublings + next.further > 0;
    sum -= before - (goes_on ? next.error : std::min(next.error, 1.0));
    if (!goes_on) continue;
    heap.push_back(next);
    std::push_heap(heap.begin(), heap.end());
  }
  while (enough && !heap.empty() && heap.front().error > kWorthSparing) {
    std::pop_heap(heap.begin(), heap.end());
    const Next next = heap.back();
    heap.pop_back();
    if (!claims[next.claim].spared_for) continue;
    if (next.cost > spare) break;
    spare -= next.cost;
    granted[next.claim] = true;
  }
  return granted;
}

bool IsMet(const Demand& demand) {
  const double room = Room(demand);
  double sum = 0;
  bool any = false;
  for (const Claim& claim : demand.claims) {
    if (claim.doublings > 0 && claim.error > kWorst * kWorst) return false;
    any = any || MayGoOn(claim, room);
    sum += Counted(claim, room);
  }
  return !any || sum <= static_cast<double>(demand.texels);
}

TilePool::TilePool(const TexelMap& map, uint32_t begin, const std::vector<bool>& valid) : places_(valid.size()) {
  std::map<int32_t, uint16_t> charts;
  for (size_t i = 0; i < places_.size(); ++i) {
    const Texel& texel = map.texels[begin + i];
    Place& place = places_[i];
    place.valid = valid[i];
    place.chart = charts.try_emplace(texel.chart, static_cast<uint16_t>(charts.size())).first->second;
    const PageSize page = map.pages[texel.page];
    for (int y = std::max(0, texel.y - 1); y <= std::min(page.height - 1, texel.y + 1); ++y) {
      for (int x = std::max(0, texel.x - 1); x <= std::min(page.width - 1, texel.x + 1); ++x) {
        const size_t at = static_cast<size_t>(y) * static_cast<size_t>(page.width) + static_cast<size_t>(x);
        const int64_t j = int64_t{map.texel_at[texel.page][at]} - begin;
        if (j < 0 || j >= std::ssize(valid) || !valid[static_cast<size_t>(j)]) continue;
        if (map.texels[begin + static_cast<size_t>(j)].chart != texel.chart) continue;
        place.near[place.near_count++] = static_cast<uint16_t>(j);
      }
    }
  }
  charts_ = charts.size();
}

std::vector<float> TilePool::Mean(std::span<const float> values) const {
  std::vector<float> means(values.size(), 0);
  for (size_t i = 0; i < values.size(); ++i) {
    const Place& place = places_[i];
    float sum = 0;
    for (size_t k = 0; k < place.near_count; ++k) sum += values[place.near[k]];
    if (place.near_count > 0) means[i] = sum / static_cast<float>(place.near_count);
  }
  return means;
}

std::vector<float> TilePool::Variance(std::vector<float> variance, std::span<const int> samples) const {
  struct Sum {
    float variance = 0, texels = 0;
  };
  std::vector<Sum> charts(charts_);
  const auto count = [&](size_t i) { return static_cast<float>(std::max(1, samples[i])); };
  for (size_t i = 0; i < variance.size(); ++i) {
    variance[i] *= count(i);
    if (!places_[i].valid) continue;
    Sum& chart = charts[places_[i].chart];
    chart.variance += variance[i];
    chart.texels += 1;
  }
  variance = Mean(variance);
  for (size_t i = 0; i < variance.size(); ++i) {
    // Where all around there is nothing, there is nothing rare.
    if (!(variance[i] > 0)) continue;
    const Sum& chart = charts[places_[i].chart];
    const float share = kChartsSamples / (kChartsSamples + kNeighbourhoodTexels * count(i));
    variance[i] = ((1 - share) * variance[i] + share * chart.variance / chart.texels) / count(i);
  }
  return variance;
}

}  // namespace bakewell
