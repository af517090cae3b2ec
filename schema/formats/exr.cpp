#include "schema/formats/exr.h"

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputPart.h>
#include <ImfMultiPartInputFile.h>
#include <ImfMultiPartOutputFile.h>
#include <ImfOutputPart.h>
#include <ImfPartType.h>
#include <ImfThreading.h>
#include <fmt/format.h>
#include <half.h>

#include <algorithm>

#include "schema/base/error.h"

namespace vantage {
namespace {

bool is_half(const ExrPart& part, const std::string& channel) {
  return std::find(part.half_channels.begin(), part.half_channels.end(), channel) != part.half_channels.end();
}

Imf::Header header_of(const ExrPart& part, std::size_t index) {
  check(!part.channels.empty(), "an EXR part has channels");
  const Plane& first = part.channels.begin()->second;
  Imf::Header header(first.width, first.height);
  header.compression() = Imf::ZIP_COMPRESSION;
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

}  // namespace

void write_exr(const std::filesystem::path& path, const std::vector<ExrPart>& parts) {
  try {
    std::vector<Imf::Header> headers;
    for (std::size_t i = 0; i < parts.size(); ++i) headers.push_back(header_of(parts[i], i));
    Imf::MultiPartOutputFile file(path.c_str(), headers.data(), static_cast<int>(headers.size()), false, 0);
    for (std::size_t i = 0; i < parts.size(); ++i) write_part(Imf::OutputPart(file, static_cast<int>(i)), parts[i]);
  } catch (const Iex::BaseExc& e) {
    throw Error(ErrorKind::Resource, fmt::format("{}: cannot write EXR: {}", path.string(), e.what()));
  }
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
