// E57 files made in memory.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <string>
#include <vector>

#include "tests/fuzz/right_page_checksums.h"

namespace rilievo::testing {

// A field of the records: its element in the prototype and its bytestream.
struct E57Column {
  std::string element, stream;
};

inline E57Column E57Reals(const std::string& name, bool single, const std::vector<double>& values) {
  E57Column column;
  column.element = "<" + name + " type=\"Float\"" + (single ? " precision=\"single\"" : "") + "/>";
  for (const double value : values) {
    column.stream += single ? LowBytesFirst(static_cast<float>(value)) : LowBytesFirst(value);
  }
  return column;
}

// Stored as the differences from `minimum`, in as few bits as hold those up to `maximum`. `more`:
// further attributes, scale and offset of a ScaledInteger.
inline E57Column E57Integers(const std::string& name, int64_t minimum, int64_t maximum,
                             const std::vector<int64_t>& values, const std::string& more = "") {
  E57Column column;
  column.element = "<" + name + " type=\"" + (more.empty() ? "Integer" : "ScaledInteger") +
                   "\" minimum=\"" + std::to_string(minimum) + "\" maximum=\"" +
                   std::to_string(maximum) + "\" " + more + "/>";
  const int bits = std::bit_width(static_cast<uint64_t>(maximum) - static_cast<uint64_t>(minimum));
  size_t at = 0;
  for (const int64_t value : values) {
    const uint64_t stored = static_cast<uint64_t>(value) - static_cast<uint64_t>(minimum);
    for (int bit = 0; bit < bits; ++bit, ++at) {
      if (at % 8 == 0) column.stream += '\0';
      if ((stored >> bit & 1) != 0) {
        column.stream.back() = static_cast<char>(column.stream.back() | 1 << at % 8);
      }
    }
  }
  return column;
}

struct E57Scan {
  std::vector<E57Column> columns = {};
  uint64_t records = 0;
  std::string more = {};  // elements of the Data3D beside the points: a pose, limits of colours
  std::string codecs = {};
  // Bytes of each column in a packet; with 0 for one of them, it comes after the others.
  std::vector<size_t> pieces = {};
  bool restarts = false;       // the flag of each packet that says so
  bool other_packets = false;  // an index packet and an empty one between those of data
};

inline std::string E57Packet(int kind, std::string content) {
  content.resize((content.size() + 3) / 4 * 4);
  return LowBytesFirst(static_cast<uint16_t>(kind)) +
         LowBytesFirst(static_cast<uint16_t>(content.size() + 3)) + content;
}

inline std::string E57Packets(const E57Scan& scan) {
  const size_t count = scan.columns.size();
  std::vector<size_t> done(count, 0);
  std::string packets;
  for (bool more = true, first = true; more; first = false) {
    std::string sizes, pieces;
    for (size_t i = 0; i < count; ++i) {
      const std::string& stream = scan.columns[i].stream;
      size_t size = std::min<size_t>(stream.size() - done[i], 20000 / count);
      if (!scan.pieces.empty()) size = std::min(size, scan.pieces[i]);
      sizes += LowBytesFirst(static_cast<uint16_t>(size));
      pieces += stream.substr(done[i], size);
      done[i] += size;
    }
    if (pieces.empty() && !first) {  // what is left are the columns that come last
      E57Scan rest = {.columns = scan.columns};
      for (size_t i = 0; i < count; ++i) rest.columns[i].stream.erase(0, done[i]);
      return packets + E57Packets(rest);
    }
    packets += E57Packet(scan.restarts ? 0x101 : 1,
                         LowBytesFirst(static_cast<uint16_t>(count)) + sizes + pieces);
    if (scan.other_packets) {
      packets += E57Packet(0, std::string(28, '\0')) + E57Packet(2, std::string(100, '\x55'));
    }
    more = false;
    for (size_t i = 0; i < count; ++i) more = more || done[i] < scan.columns[i].stream.size();
  }
  return packets;
}

inline constexpr char kE57Root[] =
    "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<!-- made by a test -->\n"
    "<e57Root type=\"Structure\" xmlns=\"http://www.astm.org/COMMIT/E57/2010-e57-v1.0\">\n";

// A file of the version 1.0. `root`: what its XML section begins with.
inline std::string E57File(const std::vector<E57Scan>& scans, size_t page = 1024,
                           const std::string& root = kE57Root) {
  const auto physical = [&](size_t logical) -> uint64_t {
    return logical / (page - 4) * page + logical % (page - 4);
  };
  std::string bytes(48, '\0'), xml = root + "<data3D type=\"Vector\">";
  for (const E57Scan& scan : scans) {
    const std::string packets = E57Packets(scan);
    const size_t begin = bytes.size();
    bytes += LowBytesFirst(uint64_t{1}) + LowBytesFirst<uint64_t>(32 + packets.size()) +
             LowBytesFirst(physical(begin + 32)) + LowBytesFirst(uint64_t{0}) + packets;
    xml += "<vectorChild type=\"Structure\"><name type=\"String\"><![CDATA[<a> & b]]></name>" +
           scan.more + "<points type=\"CompressedVector\" fileOffset=\"" +
           std::to_string(physical(begin)) + "\" recordCount=\"" + std::to_string(scan.records) +
           "\"><prototype type=\"Structure\">";
    for (const E57Column& column : scan.columns) xml += column.element;
    xml +=
        "</prototype><codecs type=\"Vector\">" + scan.codecs + "</codecs></points></vectorChild>\n";
  }
  xml += "</data3D></e57Root>\n";
  const size_t xml_begin = bytes.size();
  bytes += xml;
  bytes.replace(0, 48,
                "ASTM-E57" + LowBytesFirst(uint32_t{1}) + LowBytesFirst(uint32_t{0}) +
                    LowBytesFirst(uint64_t{0}) + LowBytesFirst(physical(xml_begin)) +
                    LowBytesFirst<uint64_t>(xml.size()) + LowBytesFirst<uint64_t>(page));
  std::string paged;
  for (size_t at = 0; at < bytes.size(); at += page - 4) {
    paged += bytes.substr(at, page - 4);
    paged.resize((at / (page - 4) + 1) * page);
  }
  return WithRightPageChecksums(paged);
}

}  // namespace rilievo::testing
