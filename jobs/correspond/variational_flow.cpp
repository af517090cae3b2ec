#include "jobs/correspond/variational_flow.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "jobs/correspond/chess_board.h"
#include "jobs/correspond/flow_pair.h"
#include "jobs/vision/vector_clones.h"

namespace vantage {
namespace {

/// residual = rest + along_x u + along_y v, in px: what a motion (u, v) leaves unexplained.
struct Constraint {
  explicit Constraint(cv::Size size) : along_x(size), along_y(size), rest(size) {}
  cv::Mat1f along_x, along_y, rest;
};

/// Grey level, x derivative, y derivative.
struct DataTerms {
  explicit DataTerms(cv::Size size) : grey(size), dx(size), dy(size) {}
  Constraint grey, dx, dy;
};

cv::Mat1f derivative(const cv::Mat1f& picture, bool along_y) {
  static const cv::Mat1f kFivePoints = (cv::Mat1f(1, 5) << 1 / 12.0F, -8 / 12.0F, 0, 8 / 12.0F, -1 / 12.0F);
  cv::Mat1f out;
  cv::filter2D(picture, out, CV_32F, along_y ? cv::Mat(kFivePoints.t()) : cv::Mat(kFivePoints), {-1, -1}, 0,
               cv::BORDER_REPLICATE);
  return out;
}

/// Divides a constraint by its derivatives' length; linearised about motion (u, v). `trust` 0 takes it out.
VANTAGE_VECTOR_CLONES void normalise_row(const float* u, const float* v, const float* trust, float noise, int width,
                                         float* ax, float* ay, float* rest) {
  for (int x = 0; x < width; ++x) {
    const float scale = trust[x] / std::sqrt(ax[x] * ax[x] + ay[x] * ay[x] + noise);
    rest[x] = (rest[x] - ax[x] * u[x] - ay[x] * v[x]) * scale;
    ax[x] *= scale;
    ay[x] *= scale;
  }
}

/// 1 where the motion ends inside the other picture.
cv::Mat1f inside(const cv::Mat1f& u, const cv::Mat1f& v, cv::Size to) {
  cv::Mat1f mask(u.size());
  for (int y = 0; y < u.rows; ++y)
    for (int x = 0; x < u.cols; ++x) {
      const float ex = static_cast<float>(x) + u(y, x), ey = static_cast<float>(y) + v(y, x);
      mask(y, x) =
          ex >= 0 && ey >= 0 && ex <= static_cast<float>(to.width - 1) && ey <= static_cast<float>(to.height - 1)
              ? 1.0F
              : 0.0F;
    }
  return mask;
}

DataTerms linearise(const cv::Mat1f& from, const cv::Mat1f& to, const cv::Mat1f& trust, const cv::Mat1f& u,
                    const cv::Mat1f& v, float gradient_noise) {
  cv::Mat2f motion;
  cv::merge(std::array<cv::Mat, 2>{u, v}, motion);
  const cv::Mat1f warped = warp_back(to, motion, cv::INTER_CUBIC);
  const cv::Mat1f from_x = derivative(from, false), from_y = derivative(from, true);
  const cv::Mat1f warped_x = derivative(warped, false), warped_y = derivative(warped, true);
  DataTerms terms(from.size());
  terms.grey.rest = warped - from;
  terms.dx.rest = warped_x - from_x;
  terms.dy.rest = warped_y - from_y;
  terms.grey.along_x = 0.5F * (warped_x + from_x);
  terms.grey.along_y = 0.5F * (warped_y + from_y);
  terms.dx.along_x = derivative(terms.grey.along_x, false);
  terms.dx.along_y = derivative(terms.grey.along_x, true);
  terms.dy.along_x = terms.dx.along_y.clone();
  terms.dy.along_y = derivative(terms.grey.along_y, true);
  cv::Mat1f counts = inside(u, v, to.size());
  if (!trust.empty()) counts = counts.mul(trust);
  const float noise = gradient_noise * gradient_noise;
  for (Constraint* c : {&terms.grey, &terms.dx, &terms.dy})
    for (int y = 0; y < u.rows; ++y)
      normalise_row(u[y], v[y], counts[y], noise, u.cols, c->along_x[y], c->along_y[y], c->rest[y]);
  return terms;
}

/// One row of the equations M (u, v) = c + sum of weighted neighbours, before the neighbours' weights are in M.
struct EquationRow {
  explicit EquationRow(int width) : values(5 * static_cast<std::size_t>(width)), w(width) {}
  float* operator[](int k) { return values.data() + static_cast<std::ptrdiff_t>(k) * w; }
  std::vector<float> values;  ///< m11, m12, m22, c1, c2
  int w;
};

struct TermRow {
  const float *ax, *ay, *rest;
};

VANTAGE_VECTOR_CLONES void data_row(TermRow grey, TermRow dx, TermRow dy, const float* u, const float* v, int width,
                                    float gradient_share, float epsilon, float* m11, float* m12, float* m22, float* c1,
                                    float* c2) {
  for (int x = 0; x < width; ++x) {
    const float rg = grey.rest[x] + grey.ax[x] * u[x] + grey.ay[x] * v[x];
    const float rx = dx.rest[x] + dx.ax[x] * u[x] + dx.ay[x] * v[x];
    const float ry = dy.rest[x] + dy.ax[x] * u[x] + dy.ay[x] * v[x];
    const float wg = 1 / std::sqrt(rg * rg + epsilon);
    const float wd = gradient_share / std::sqrt(rx * rx + ry * ry + epsilon);
    m11[x] = wg * grey.ax[x] * grey.ax[x] + wd * (dx.ax[x] * dx.ax[x] + dy.ax[x] * dy.ax[x]);
    m12[x] = wg * grey.ax[x] * grey.ay[x] + wd * (dx.ax[x] * dx.ay[x] + dy.ax[x] * dy.ay[x]);
    m22[x] = wg * grey.ay[x] * grey.ay[x] + wd * (dx.ay[x] * dx.ay[x] + dy.ay[x] * dy.ay[x]);
    c1[x] = -wg * grey.ax[x] * grey.rest[x] - wd * (dx.ax[x] * dx.rest[x] + dy.ax[x] * dy.rest[x]);
    c2[x] = -wg * grey.ay[x] * grey.rest[x] - wd * (dx.ay[x] * dx.rest[x] + dy.ay[x] * dy.rest[x]);
  }
}

/// Weights between neighbours: `next` lies one further along the edge, `near`/`far` pairs on both sides of it.
struct EdgeRow {
  const float *u, *v, *u_next, *v_next;
  std::array<const float*, 4> u_side, v_side;  ///< after (this, next), before (this, next)
};

VANTAGE_VECTOR_CLONES void smooth_row(const EdgeRow& e, const float* strength, int width, float epsilon, float* out) {
  for (int x = 0; x < width; ++x) {
    const float du = e.u_next[x] - e.u[x], dv = e.v_next[x] - e.v[x];
    const float cu = 0.25F * (e.u_side[0][x] + e.u_side[1][x] - e.u_side[2][x] - e.u_side[3][x]);
    const float cv = 0.25F * (e.v_side[0][x] + e.v_side[1][x] - e.v_side[2][x] - e.v_side[3][x]);
    out[x] = strength[x] / std::sqrt(du * du + dv * dv + cu * cu + cv * cv + epsilon);
  }
}

VANTAGE_VECTOR_CLONES void invert_row(const float* left, const float* right, const float* up, const float* down,
                                      int width, float* m11, float* m12, float* m22) {
  for (int x = 0; x < width; ++x) {
    const float sum = left[x] + right[x] + up[x] + down[x] + 1e-9F;
    const float a = m11[x] + sum, b = m12[x], d = m22[x] + sum;
    const float scale = 1 / (a * d - b * b);
    m11[x] = d * scale;
    m12[x] = -b * scale;
    m22[x] = a * scale;
  }
}

struct SweepRow {
  const float *m11, *m12, *m22, *c1, *c2, *left, *right, *up, *down;
  const float *u_left, *u_right, *u_up, *u_down, *v_left, *v_right, *v_up, *v_down;
};

VANTAGE_VECTOR_CLONES void relax_row(const SweepRow& r, int count, float omega, float* __restrict u,
                                     float* __restrict v) {
  for (int i = 0; i < count; ++i) {
    const float su =
        r.c1[i] + r.left[i] * r.u_left[i] + r.right[i] * r.u_right[i] + r.up[i] * r.u_up[i] + r.down[i] * r.u_down[i];
    const float sv =
        r.c2[i] + r.left[i] * r.v_left[i] + r.right[i] * r.v_right[i] + r.up[i] * r.v_up[i] + r.down[i] * r.v_down[i];
    u[i] += omega * (r.m11[i] * su + r.m12[i] * sv - u[i]);
    v[i] += omega * (r.m12[i] * su + r.m22[i] * sv - v[i]);
  }
}

/// The linear system on a chess board and its unknowns.
class System {
 public:
  explicit System(cv::Size size)
      : size_(size),
        u_(board()),
        v_(board()),
        right_(board()),
        down_(board()),
        m11_(board()),
        m12_(board()),
        m22_(board()),
        c1_(board()),
        c2_(board()) {}

  void set_motion(const cv::Mat1f& u, const cv::Mat1f& v) {
    for (int y = 0; y < size_.height; ++y) scatter(u[y], y, u_), scatter(v[y], y, v_);
  }
  void motion(cv::Mat1f& u, cv::Mat1f& v) const {
    for (int y = 0; y < size_.height; ++y) gather(u_, y, u[y]), gather(v_, y, v[y]);
  }
  void set_row(int y, EquationRow& row, const float* right, const float* down) {
    scatter(row[0], y, m11_), scatter(row[1], y, m12_), scatter(row[2], y, m22_);
    scatter(row[3], y, c1_), scatter(row[4], y, c2_);
    scatter(right, y, right_), scatter(down, y, down_);
  }
  void relax(int sweeps) {
    constexpr float kOmega = 1.8F;
    for (int k = 0; k < sweeps; ++k)
      for (int colour = 0; colour < 2; ++colour)
        for (int y = 0; y < size_.height; ++y) relax(colour, y, kOmega);
  }

 private:
  ChessBoard board() const { return {size_.width, size_.height}; }
  void scatter(const float* row, int y, ChessBoard& to) const {
    for (int colour = 0; colour < 2; ++colour) {
      const int p = ChessBoard::parity(colour, y), count = (size_.width - p + 1) / 2;
      float* out = to.row(colour, y);
      for (int i = 0; i < count; ++i) out[i] = row[2 * i + p];
    }
  }
  void gather(const ChessBoard& from, int y, float* row) const {
    for (int colour = 0; colour < 2; ++colour) {
      const int p = ChessBoard::parity(colour, y), count = (size_.width - p + 1) / 2;
      const float* in = from.row(colour, y);
      for (int i = 0; i < count; ++i) row[2 * i + p] = in[i];
    }
  }
  void relax(int colour, int y, float omega) {
    const int other = 1 - colour, p = ChessBoard::parity(colour, y);
    const float *u = u_.row(other, y), *v = v_.row(other, y);
    relax_row({m11_.row(colour, y), m12_.row(colour, y), m22_.row(colour, y), c1_.row(colour, y), c2_.row(colour, y),
               right_.row(other, y) - 1 + p, right_.row(colour, y), down_.row(other, y - 1), down_.row(colour, y),
               u - 1 + p, u + p, u_.row(other, y - 1), u_.row(other, y + 1), v - 1 + p, v + p, v_.row(other, y - 1),
               v_.row(other, y + 1)},
              (size_.width - p + 1) / 2, omega, u_.row(colour, y), v_.row(colour, y));
  }

  cv::Size size_;
  ChessBoard u_, v_, right_, down_, m11_, m12_, m22_, c1_, c2_;
};

/// How strongly neighbours hold together, before robustness: less across the picture's edges. Zero over the border.
struct Strength {
  cv::Mat1f right, down;
};

Strength strength_of(const cv::Mat1f& picture, const VariationalOptions& options) {
  Strength s{cv::Mat1f(picture.size(), 0.0F), cv::Mat1f(picture.size(), 0.0F)};
  const auto weight = [&](float step) {
    return options.smoothness * std::exp(-std::abs(step) / options.edge_contrast);
  };
  for (int y = 0; y < picture.rows; ++y)
    for (int x = 0; x < picture.cols; ++x) {
      if (x + 1 < picture.cols) s.right(y, x) = weight(picture(y, x + 1) - picture(y, x));
      if (y + 1 < picture.rows) s.down(y, x) = weight(picture(y + 1, x) - picture(y, x));
    }
  return s;
}

/// u and v with a margin of one repeated pixel.
struct Padded {
  cv::Mat1f u, v;
  const float* u_row(int y) const { return u[y + 1] + 1; }
  const float* v_row(int y) const { return v[y + 1] + 1; }
};

Padded padded(const cv::Mat1f& u, const cv::Mat1f& v) {
  Padded out;
  cv::copyMakeBorder(u, out.u, 1, 1, 1, 1, cv::BORDER_REPLICATE);
  cv::copyMakeBorder(v, out.v, 1, 1, 1, 1, cv::BORDER_REPLICATE);
  return out;
}

void assemble(const DataTerms& terms, const Strength& strength, const cv::Mat1f& u, const cv::Mat1f& v,
              const VariationalOptions& options, System& system) {
  const int w = u.cols;
  const Padded p = padded(u, v);
  const float data_epsilon = options.data_epsilon_px * options.data_epsilon_px,
              smooth_epsilon = options.smooth_epsilon_px * options.smooth_epsilon_px;
  std::vector<float> right(static_cast<std::size_t>(w) + 1, 0.0F), down(static_cast<std::size_t>(w), 0.0F),
      up(static_cast<std::size_t>(w), 0.0F);
  EquationRow row(w);
  for (int y = 0; y < u.rows; ++y) {
    const auto term = [&](const Constraint& c) { return TermRow{c.along_x[y], c.along_y[y], c.rest[y]}; };
    data_row(term(terms.grey), term(terms.dx), term(terms.dy), u[y], v[y], w, options.gradient_share, data_epsilon,
             row[0], row[1], row[2], row[3], row[4]);
    const float *u0 = p.u_row(y), *v0 = p.v_row(y), *u1 = p.u_row(y + 1), *v1 = p.v_row(y + 1), *um = p.u_row(y - 1),
                *vm = p.v_row(y - 1);
    smooth_row({u0, v0, u0 + 1, v0 + 1, {u1, u1 + 1, um, um + 1}, {v1, v1 + 1, vm, vm + 1}}, strength.right[y], w,
               smooth_epsilon, right.data() + 1);
    smooth_row({u0, v0, u1, v1, {u0 + 1, u1 + 1, u0 - 1, u1 - 1}, {v0 + 1, v1 + 1, v0 - 1, v1 - 1}}, strength.down[y],
               w, smooth_epsilon, down.data());
    invert_row(right.data(), right.data() + 1, up.data(), down.data(), w, row[0], row[1], row[2]);
    system.set_row(y, row, right.data() + 1, down.data());
    up.swap(down);
  }
}

}  // namespace

void refine_variational(const cv::Mat1f& from, const cv::Mat1f& to, const cv::Mat1f& trust, cv::Mat2f& motion,
                        const VariationalOptions& options) {
  const Strength strength = strength_of(from, options);
  cv::Mat1f u, v;
  cv::extractChannel(motion, u, 0);
  cv::extractChannel(motion, v, 1);
  System system(from.size());
  for (int warp = 0; warp < options.warps; ++warp) {
    const DataTerms terms = linearise(from, to, trust, u, v, options.gradient_noise);
    system.set_motion(u, v);
    for (int k = 0; k < options.reweightings; ++k) {
      assemble(terms, strength, u, v, options, system);
      system.relax(options.sweeps);
      system.motion(u, v);
    }
    cv::medianBlur(u, u, 5);
    cv::medianBlur(v, v, 5);
  }
  cv::merge(std::array<cv::Mat, 2>{u, v}, motion);
}

}  // namespace vantage
