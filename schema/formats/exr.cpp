#include "schema/formats/exr.h"

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfFramesPerSecond.h>
#include <ImfHeader.h>
#include <ImfInputPart.h>
#include <ImfMultiPartInputFile.h>
#include <ImfMultiPartOutputFile.h>
#include <ImfOutputPart.h>
#include <ImfPartType.h>
#include <ImfStandardAttributes.h>
#include <ImfThreading.h>
#include <fmt/format.h>
#include <half.h>

#include <algorithm>

#include "schema/base/error.h"
#include "schema/formats/exr_camera.h"

namespace vantage {
namespace {

bool is_half(const ExrPart& part, const std::string& channel) {
  return std::find(part.half_channels.begin(), part.half_channels.end(), channel) != part.half_channels.end();
}

Imf::Header header_of(const ExrPart& part, std::size_t index) {
  check(!part.channels.empty(), "an EXR part has channels");
  const Plane& first = part.channels.begin()->second;
  Imf::Header header(first.width, first.height);
  header.compression() = part.compressed ? Imf::ZIP_COMPRESSION : Imf::NO_COMPRESSION;
  header.setType(Imf::SCANLINEIMAGE);
  header.setName(part.view.empty() ? fmt::format("part{}", index) : part.view);
  if (!part.view.empty()) header.setView(part.view);
  for (const auto& [name, plane] : part.channels) {
    check(plane.width == first.width && plane.height == first.height, "channels of an EXR part have one size");
    header.channels().insert(name, Imf::Channel(is_half(part, name) ? Imf::HALF : Imf::FLOAT));
  }
  return header;
}

void write_part(Imf::OutputPart out, const ExrPart& part) {
  Imf::FrameBuffer buffer;
  std::vector<std::vector<half>> halves;
  halves.reserve(part.channels.size());
  for (const auto& [name, plane] : part.channels) {
    const auto width = static_cast<std::size_t>(plane.width);
    if (is_half(part, name)) {
      halves.emplace_back(plane.values.begin(), plane.values.end());
      buffer.insert(name, Imf::Slice(Imf::HALF, reinterpret_cast<char*>(halves.back().data()), sizeof(half),
                                     sizeof(half) * width));
    } else {
      auto* data = const_cast<float*>(plane.values.data());  // OpenEXR's slices are not const, but writing only reads
      buffer.insert(name, Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(data), sizeof(float), sizeof(float) * width));
    }
  }
  out.setFrameBuffer(buffer);
  out.writePixels(part.channels.begin()->second.height);
}

/// For row vectors, as Imath has them.
Imath::M44f transposed(const Eigen::Matrix4d& m) {
  Imath::M44f out;
  for (int r = 0; r < 4; ++r)
    for (int c = 0; c < 4; ++c) out[r][c] = static_cast<float>(m(c, r));
  return out;
}

void add_camera(Imf::Header& header, const ExrCamera& camera) {
  const Pinhole& p = camera.pinhole;
  Eigen::Matrix4d cam_from_world = Eigen::Matrix4d::Identity();
  cam_from_world.topLeftCorner<3, 3>() = camera.cam_from_world.R;
  cam_from_world.topRightCorner<3, 1>() = camera.cam_from_world.t;
  const Eigen::Matrix4d y_up = Eigen::Vector4d(1, -1, 1, 1).asDiagonal();
  Eigen::Matrix4d ndc_from_cam = Eigen::Matrix4d::Zero();
  ndc_from_cam.row(0) << p.fx / p.width, 0, p.cx / p.width, 0;
  ndc_from_cam.row(1) << 0, p.fy / p.height, p.cy / p.height, 0;
  ndc_from_cam(2, 2) = ndc_from_cam(3, 2) = 1;
  Imf::addWorldToCamera(header, transposed(y_up * cam_from_world));
  Imf::addWorldToNDC(header, transposed(ndc_from_cam * cam_from_world));
  Imf::addFramesPerSecond(header, Imf::guessExactFps(camera.fps));
}

void write_parts(const std::filesystem::path& path, const std::vector<ExrPart>& parts,
                 const std::vector<Imf::Header>& headers) {
  try {
    Imf::MultiPartOutputFile file(path.c_str(), headers.data(), static_cast<int>(headers.size()), false, 0);
    for (std::size_t i = 0; i < parts.size(); ++i) write_part(Imf::OutputPart(file, static_cast<int>(i)), parts[i]);
  } catch (const Iex::BaseExc& e) {
    throw Error(ErrorKind::Resource, fmt::format("{}: cannot write EXR: {}", path.string(), e.what()));
  }
}

std::vector<Imf::Header> headers_of(const std::vector<ExrPart>& parts) {
  std::vector<Imf::Header> headers;
  for (std::size_t i = 0; i < parts.size(); ++i) headers.push_back(header_of(parts[i], i));
  return headers;
}

}  // namespace

void write_exr(const std::filesystem::path& path, const std::vector<ExrPart>& parts) {
  write_parts(path, parts, headers_of(parts));
}

void write_exr(const std::filesystem::path& path, const std::vector<ExrPart>& parts,
               const std::vector<ExrCamera>& cameras) {
  check(parts.size() == cameras.size(), "every part of a film frame has a camera");
  std::vector<Imf::Header> headers = headers_of(parts);
  for (std::size_t i = 0; i < parts.size(); ++i) add_camera(headers[i], cameras[i]);
  write_parts(path, parts, headers);
}

Channels read_exr(const std::filesystem::path& path, const std::string& view) {
  try {
    Imf::MultiPartInputFile file(path.c_str(), 0);
    for (int i = 0; i < file.parts(); ++i) {
      const Imf::Header& header = file.header(i);
      if (!view.empty() && !(header.hasView() && header.view() == view)) continue;
      const auto window = header.dataWindow();
      const int width = window.max.x - window.min.x + 1, height = window.max.y - window.min.y + 1;
      Channels channels;
      Imf::FrameBuffer buffer;
      for (auto c = header.channels().begin(); c != header.channels().end(); ++c) {
        Plane& plane = channels[c.name()];
        plane = {width, height, std::vector<float>(static_cast<std::size_t>(width) * static_cast<std::size_t>(height))};
        buffer.insert(c.name(), Imf::Slice::Make(Imf::FLOAT, plane.values.data(), window));
      }
      Imf::InputPart part(file, i);
      part.setFrameBuffer(buffer);
      part.readPixels(window.min.y, window.max.y);
      return channels;
    }
  } catch (const Iex::BaseExc& e) {
    throw Error(ErrorKind::BadInput, fmt::format("{}: cannot read EXR: {}", path.string(), e.what()));
  }
  throw Error(ErrorKind::BadInput, fmt::format("{}: has no view '{}'", path.string(), view));
}

}  // namespace vantage
