#include "jobs/align/clock_graph.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "schema/base/error.h"

namespace vantage::align {
namespace {

constexpr int kL1Iterations = 200;
constexpr int kHuberIterations = 20;
constexpr double kHuberScale = 1.5;
/// Clocks of cameras that run as they say: crystals at room temperature.
constexpr double kClockRateStd = 50e-6;
/// A pair that could not tell the rate still says that it is nothing outlandish.
constexpr double kUntoldRateStd = 0.02;
/// A frame rate is not what it says where pairs say so by this: deviations that hold, of a few cameras.
constexpr double kOddDeviations = 3;
/// Of the variance of a camera's pairs, so much is an error of that camera's clock that all of them make: half of a
/// pair's noise is in the one camera's tracks, which its other pairs use too; half of that lies along the motion, where
/// it looks like time from every other camera; and about half of the tracks are the same ones.
constexpr double kSharedByCamera = 0.125;
/// No pair is trusted beyond this part of a frame: systematic errors (rolling shutter, other points) are never less.
constexpr double kFloorFrames = 0.01;

struct Edge {
  std::size_t pair = 0, a = 0, b = 0;
  double time_a_s = 0, time_b_s = 0;  // of one moment, by the two cameras' own clocks
  double std_s = 0, frame_s = 0;
  double rate = 1, rate_std = 0;
};

/// Value of every camera of `members` with value[b] - value[a] = measured for the edges; members.front() is 0.
struct Graph {
  std::vector<std::size_t> members;
  std::vector<Edge> edges;

  Eigen::MatrixXd normal_matrix(const Eigen::VectorXd& weights) const {
    Eigen::MatrixXd N = Eigen::MatrixXd::Zero(std::ssize(members), std::ssize(members));
    for (std::size_t e = 0; e < edges.size(); ++e) {
      const auto i = index_of(edges[e].a), j = index_of(edges[e].b);
      const double w = weights[static_cast<Eigen::Index>(e)];
      N(i, i) += w, N(j, j) += w, N(i, j) -= w, N(j, i) -= w;
    }
    return N.bottomRightCorner(N.rows() - 1, N.cols() - 1);
  }
  Eigen::VectorXd solve(const Eigen::VectorXd& measured, const Eigen::VectorXd& weights) const {
    Eigen::VectorXd rhs = Eigen::VectorXd::Zero(std::ssize(members));
    for (std::size_t e = 0; e < edges.size(); ++e) {
      const auto k = static_cast<Eigen::Index>(e);
      rhs[index_of(edges[e].b)] += weights[k] * measured[k];
      rhs[index_of(edges[e].a)] -= weights[k] * measured[k];
    }
    Eigen::VectorXd x = Eigen::VectorXd::Zero(rhs.size());
    x.tail(x.size() - 1) = normal_matrix(weights).ldlt().solve(rhs.tail(rhs.size() - 1));
    return x;
  }
  Eigen::VectorXd residuals(const Eigen::VectorXd& x, const Eigen::VectorXd& measured) const {
    Eigen::VectorXd r(std::ssize(edges));
    for (std::size_t e = 0; e < edges.size(); ++e) {
      const auto k = static_cast<Eigen::Index>(e);
      r[k] = measured[k] - (x[index_of(edges[e].b)] - x[index_of(edges[e].a)]);
    }
    return r;
  }
  Eigen::Index index_of(std::size_t camera) const {
    return std::find(members.begin(), members.end(), camera) - members.begin();
  }
};

Eigen::VectorXd stds_of(const Graph& graph) {
  Eigen::VectorXd stds(std::ssize(graph.edges));
  for (std::size_t e = 0; e < graph.edges.size(); ++e) stds[static_cast<Eigen::Index>(e)] = graph.edges[e].std_s;
  return stds;
}

/// Least absolute deviations in units of the standard deviations.
Eigen::VectorXd solve_l1(const Graph& graph, const Eigen::VectorXd& measured, const Eigen::VectorXd& stds) {
  Eigen::VectorXd weights = stds.array().square().inverse();
  Eigen::VectorXd x = graph.solve(measured, weights);
  for (int k = 0; k < kL1Iterations; ++k) {
    // The guard shrinks, so that pairs that agree end up exact without dividing by zero on the way.
    const double guard = std::max(1e-4, std::pow(0.8, k));
    const Eigen::ArrayXd deviation = (graph.residuals(x, measured).array() / stds.array()).abs().max(guard);
    weights = (stds.array().square() * deviation).inverse();
    x = graph.solve(measured, weights);
  }
  return x;
}

Eigen::VectorXd huber_weights(const Eigen::VectorXd& residuals, const Eigen::VectorXd& stds) {
  const Eigen::ArrayXd deviation = (residuals.array() / stds.array()).abs().max(1e-12);
  return (kHuberScale / deviation).min(1.0) / stds.array().square();
}

/// Cameras joined by edges, each group in order; groups in order of their first camera.
std::vector<std::vector<std::size_t>> groups_of(std::size_t num_cameras, const std::vector<Edge>& edges) {
  std::vector<std::size_t> label(num_cameras);
  std::iota(label.begin(), label.end(), std::size_t{0});
  for (bool changed = true; changed;) {
    changed = false;
    for (const Edge& e : edges) {
      const std::size_t lower = std::min(label[e.a], label[e.b]);
      changed = changed || label[e.a] != label[e.b];
      label[e.a] = label[e.b] = lower;
    }
  }
  std::map<std::size_t, std::vector<std::size_t>> by_label;
  for (std::size_t c = 0; c < num_cameras; ++c) by_label[label[c]].push_back(c);
  std::vector<std::vector<std::size_t>> groups;
  for (auto& [first, members] : by_label) groups.push_back(std::move(members));
  return groups;
}

std::vector<std::size_t> group_of_reference(std::size_t num_cameras, const std::vector<Edge>& edges) {
  const auto groups = groups_of(num_cameras, edges);
  if (groups.front().size() > 1) return groups.front();
  return *std::max_element(groups.begin(), groups.end(), [](auto& p, auto& q) { return p.size() < q.size(); });
}

Graph graph_of(std::size_t num_cameras, const std::vector<Edge>& edges) {
  Graph graph{group_of_reference(num_cameras, edges), {}};
  for (const Edge& e : edges)
    if (std::find(graph.members.begin(), graph.members.end(), e.a) != graph.members.end()) graph.edges.push_back(e);
  return graph;
}

std::vector<Edge> edges_of(const std::vector<GraphCamera>& cameras, const std::vector<PairOffset>& pairs) {
  const auto find = [&](const std::string& name) {
    const auto at = std::find_if(cameras.begin(), cameras.end(), [&](const GraphCamera& c) { return c.name == name; });
    check(at != cameras.end(), "pairs are of the shot's cameras");
    return static_cast<std::size_t>(at - cameras.begin());
  };
  std::vector<Edge> edges;
  for (std::size_t p = 0; p < pairs.size(); ++p) {
    if (!pairs[p].determined) continue;
    const std::size_t a = find(pairs[p].a), b = find(pairs[p].b);
    const double frame_s = std::max(cameras[a].frame_s, cameras[b].frame_s);
    const double time_b_s = pairs[p].pivot_b_s, time_a_s = pairs[p].offset_s + pairs[p].rate * time_b_s;
    const bool tells_rate = pairs[p].rate_std > 0;
    edges.push_back({p, a, b, time_a_s, time_b_s, std::hypot(pairs[p].std_s, kFloorFrames * frame_s), frame_s,
                     tells_rate ? pairs[p].rate : 1, tells_rate ? pairs[p].rate_std : kUntoldRateStd});
  }
  return edges;
}

struct Posterior {
  Eigen::VectorXd x, std;
};

/// Of what each member's pairs err by together, to which the graph's cycles are blind.
Eigen::VectorXd shared_variances(const Graph& graph, const Eigen::VectorXd& weights) {
  Eigen::VectorXd num = Eigen::VectorXd::Zero(std::ssize(graph.members)), information = num;
  for (std::size_t e = 0; e < graph.edges.size(); ++e)
    for (const std::size_t camera : {graph.edges[e].a, graph.edges[e].b}) {
      num[graph.index_of(camera)] += 1;
      information[graph.index_of(camera)] += weights[static_cast<Eigen::Index>(e)];
    }
  return kSharedByCamera * num.cwiseQuotient(information);
}

/// prior_stds: of each member about its prior value 0; empty for none.
Posterior least_squares(const Graph& graph, const Eigen::VectorXd& measured, const Eigen::VectorXd& stds,
                        const Eigen::VectorXd& start, const Eigen::VectorXd& prior_stds = {}) {
  const Eigen::Index num = std::ssize(graph.members) - 1;
  Eigen::VectorXd prior = Eigen::VectorXd::Zero(num);
  if (prior_stds.size() > 0) prior = prior_stds.tail(num).array().square().inverse();
  Eigen::VectorXd x = start, weights;
  Eigen::MatrixXd N;
  for (int k = 0; k < kHuberIterations; ++k) {
    weights = huber_weights(graph.residuals(x, measured), stds);
    N = graph.normal_matrix(weights);
    const Eigen::VectorXd rhs = N * graph.solve(measured, weights).tail(num);
    N.diagonal() += prior;
    x.tail(num) = N.ldlt().solve(rhs);
  }
  const double chi2 = graph.residuals(x, measured).array().square().matrix().dot(weights);
  const auto freedom = static_cast<double>(std::ssize(graph.edges) - num);
  const double inflate = freedom > 0 ? std::max(1.0, chi2 / freedom) : 1;
  Eigen::VectorXd std = Eigen::VectorXd::Zero(x.size());
  const Eigen::VectorXd shared = shared_variances(graph, weights);
  std.tail(num) = (inflate * (N.inverse().diagonal().array() + shared.tail(num).array() + shared[0])).sqrt();
  if (prior_stds.size() > 0) std = std.cwiseMin(prior_stds);
  return {x, std};
}

/// Rates of the members, the reference's being 1: log rate_b - log rate_a = log rate_ab. A camera's clock is taken to
/// run as well as crystals do unless the pairs clearly say otherwise: then its frame rate is not what it says, and it
/// runs as they say.
Posterior solve_rates(const Graph& graph) {
  const auto num = std::ssize(graph.members);
  if (std::none_of(graph.edges.begin(), graph.edges.end(), [](const Edge& e) { return e.rate_std < kUntoldRateStd; }))
    return {Eigen::VectorXd::Ones(num), Eigen::VectorXd::Zero(num)};
  Eigen::VectorXd logs(std::ssize(graph.edges)), stds(logs.size());
  for (std::size_t e = 0; e < graph.edges.size(); ++e) {
    logs[static_cast<Eigen::Index>(e)] = std::log(graph.edges[e].rate);
    stds[static_cast<Eigen::Index>(e)] = graph.edges[e].rate_std;
  }
  const Eigen::VectorXd start = solve_l1(graph, logs, stds);
  const Posterior free = least_squares(graph, logs, stds, start);
  Eigen::VectorXd prior_stds = Eigen::VectorXd::Constant(num, kClockRateStd);
  for (Eigen::Index k = 1; k < num; ++k)
    if (std::abs(free.x[k]) > kOddDeviations * std::hypot(free.std[k], kClockRateStd)) prior_stds[k] = 1;
  Posterior rates = least_squares(graph, logs, stds, start, prior_stds);
  rates.x = rates.x.array().exp();
  return rates;
}

/// At the moment that a pair ties: offset_a + rate_a · time_a = offset_b + rate_b · time_b.
Eigen::VectorXd measured_offsets(const Graph& graph, const Eigen::VectorXd& rates) {
  Eigen::VectorXd offsets(std::ssize(graph.edges));
  for (std::size_t e = 0; e < graph.edges.size(); ++e) {
    const Edge& edge = graph.edges[e];
    offsets[static_cast<Eigen::Index>(e)] =
        rates[graph.index_of(edge.a)] * edge.time_a_s - rates[graph.index_of(edge.b)] * edge.time_b_s;
  }
  return offsets;
}

/// The edge that is farthest beyond its limits; edges.size() when all are within.
std::size_t worst_edge(const Graph& graph, const GraphOptions& options) {
  const Eigen::VectorXd measured = measured_offsets(graph, solve_rates(graph).x), stds = stds_of(graph);
  const Eigen::VectorXd r = graph.residuals(solve_l1(graph, measured, stds), measured);
  std::size_t worst = graph.edges.size();
  double most = 1;
  for (std::size_t e = 0; e < graph.edges.size(); ++e) {
    const double off = std::abs(r[static_cast<Eigen::Index>(e)]);
    const Edge& edge = graph.edges[e];
    const double beyond = std::max(off / (options.max_inconsistency_std * edge.std_s),
                                   off / (options.max_inconsistency_frames * edge.frame_s));
    if (beyond > most) most = beyond, worst = e;
  }
  return worst;
}

}  // namespace

ClockSolution solve_clocks(const std::vector<GraphCamera>& cameras, const std::vector<PairOffset>& pairs,
                           double start_s, const GraphOptions& options) {
  const std::vector<Edge> all = edges_of(cameras, pairs);
  std::vector<Edge> used = all;
  Graph graph = graph_of(cameras.size(), used);
  while (graph.members.size() > 1) {
    const std::size_t worst = worst_edge(graph, options);
    if (worst == graph.edges.size()) break;
    std::erase_if(used, [&](const Edge& e) { return e.pair == graph.edges[worst].pair; });
    graph = graph_of(cameras.size(), used);
  }

  ClockSolution solution;
  Posterior rates{Eigen::VectorXd::Ones(1), Eigen::VectorXd::Zero(1)}, offsets{Eigen::VectorXd::Zero(1), rates.std};
  if (graph.members.size() > 1) {
    rates = solve_rates(graph);
    const Eigen::VectorXd measured = measured_offsets(graph, rates.x), stds = stds_of(graph);
    offsets = least_squares(graph, measured, stds, solve_l1(graph, measured, stds));
  }
  solution.clocks.reference = cameras[graph.members.front()].name;
  for (std::size_t k = 0; k < graph.members.size(); ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    solution.clocks.cameras.push_back(
        {cameras[graph.members[k]].name, start_s + offsets.x[i], rates.x[i], offsets.std[i], rates.std[i]});
  }
  for (const GraphCamera& camera : cameras)
    if (!solution.clocks.find(camera.name)) solution.left_out.push_back(camera.name);
  for (const Edge& e : all) {
    const CameraClock *a = solution.clocks.find(cameras[e.a].name), *b = solution.clocks.find(cameras[e.b].name);
    if (!a || !b) continue;
    const bool rejected = std::none_of(used.begin(), used.end(), [&](const Edge& u) { return u.pair == e.pair; });
    const double residual_s = e.time_a_s - (b->shot_time_s(e.time_b_s) - a->offset_s) / a->rate;
    solution.residuals.push_back({e.pair, residual_s, rejected});
  }
  return solution;
}

}  // namespace vantage::align
