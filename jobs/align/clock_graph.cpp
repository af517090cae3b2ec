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
/// No pair is trusted beyond this part of a frame: systematic errors (rolling shutter, other points) are never less.
constexpr double kFloorFrames = 0.01;

struct Edge {
  std::size_t pair = 0, a = 0, b = 0;
  double offset_s = 0, rate = 1, std_s = 0, frame_s = 0;
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
    edges.push_back(
        {p, a, b, pairs[p].offset_s, pairs[p].rate, std::hypot(pairs[p].std_s, kFloorFrames * frame_s), frame_s});
  }
  return edges;
}

/// Rates of the members, the reference's being 1: log rate_b - log rate_a = log rate_ab.
Eigen::VectorXd solve_rates(const Graph& graph) {
  Eigen::VectorXd logs(std::ssize(graph.edges));
  for (std::size_t e = 0; e < graph.edges.size(); ++e)
    logs[static_cast<Eigen::Index>(e)] = std::log(graph.edges[e].rate);
  return solve_l1(graph, logs, stds_of(graph)).array().exp();
}

Eigen::VectorXd measured_offsets(const Graph& graph, const Eigen::VectorXd& rates) {
  Eigen::VectorXd offsets(std::ssize(graph.edges));
  for (std::size_t e = 0; e < graph.edges.size(); ++e)
    offsets[static_cast<Eigen::Index>(e)] = rates[graph.index_of(graph.edges[e].a)] * graph.edges[e].offset_s;
  return offsets;
}

/// The edge that is farthest beyond its limits; edges.size() when all are within.
std::size_t worst_edge(const Graph& graph, const GraphOptions& options) {
  const Eigen::VectorXd rates = solve_rates(graph), measured = measured_offsets(graph, rates), stds = stds_of(graph);
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

struct Posterior {
  Eigen::VectorXd x, std;
};

Posterior solve_huber(const Graph& graph, const Eigen::VectorXd& measured) {
  const Eigen::VectorXd stds = stds_of(graph);
  Eigen::VectorXd x = solve_l1(graph, measured, stds), weights;
  for (int k = 0; k < kHuberIterations; ++k) {
    weights = huber_weights(graph.residuals(x, measured), stds);
    x = graph.solve(measured, weights);
  }
  const double chi2 = graph.residuals(x, measured).array().square().matrix().dot(weights);
  const auto freedom = static_cast<double>(std::ssize(graph.edges) - std::ssize(graph.members) + 1);
  const double inflate = freedom > 0 ? std::max(1.0, chi2 / freedom) : 1;
  Eigen::VectorXd std = Eigen::VectorXd::Zero(x.size());
  std.tail(std.size() - 1) = (inflate * graph.normal_matrix(weights).inverse().diagonal()).array().sqrt();
  return {x, std};
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
  Eigen::VectorXd rates = Eigen::VectorXd::Ones(1);
  Posterior posterior{Eigen::VectorXd::Zero(1), Eigen::VectorXd::Zero(1)};
  if (graph.members.size() > 1) {
    rates = solve_rates(graph);
    posterior = solve_huber(graph, measured_offsets(graph, rates));
  }
  solution.clocks.reference = cameras[graph.members.front()].name;
  for (std::size_t k = 0; k < graph.members.size(); ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    solution.clocks.cameras.push_back(
        {cameras[graph.members[k]].name, start_s + posterior.x[i], rates[i], posterior.std[i]});
  }
  for (const GraphCamera& camera : cameras)
    if (!solution.clocks.find(camera.name)) solution.left_out.push_back(camera.name);
  for (const Edge& e : all) {
    const CameraClock *a = solution.clocks.find(cameras[e.a].name), *b = solution.clocks.find(cameras[e.b].name);
    if (!a || !b) continue;
    const bool rejected = std::none_of(used.begin(), used.end(), [&](const Edge& u) { return u.pair == e.pair; });
    solution.residuals.push_back({e.pair, e.offset_s - (b->offset_s - a->offset_s) / a->rate, rejected});
  }
  return solution;
}

}  // namespace vantage::align
