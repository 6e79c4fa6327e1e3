// glTF and 3MF files made by hand, for tests.
#pragma once

#include <bit>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include "algorithms/io/scenes/zip_archive.h"

namespace hermesh {

/// Appends a number as glTF stores it, little-endian.
template <class T>
void put_number(std::string& bytes, T value) {
  char raw[sizeof value];
  std::memcpy(raw, &value, sizeof value);
  if (std::endian::native == std::endian::big) std::reverse(raw, raw + sizeof value);
  bytes.append(raw, sizeof value);
}

template <class T>
std::string numbers_of(const std::vector<T>& values) {
  std::string bytes;
  for (const T value : values) put_number(bytes, value);
  return bytes;
}

/// A .glb file of these chunks; without a second one where it is empty.
inline std::string glb_of(std::string json, std::string binary) {
  while (json.size() % 4 != 0) json += ' ';
  while (binary.size() % 4 != 0) binary += '\0';
  std::string bytes = "glTF";
  put_number(bytes, std::uint32_t(2));
  put_number(bytes, std::uint32_t(20 + json.size() + (binary.empty() ? 0 : 8 + binary.size())));
  put_number(bytes, std::uint32_t(json.size()));
  bytes += "JSON" + json;
  if (binary.empty()) return bytes;
  put_number(bytes, std::uint32_t(binary.size()));
  return bytes + std::string("BIN\0", 4) + binary;
}

inline std::string zip_of(const std::vector<std::pair<std::string, std::string>>& members) {
  mesh_formats::ZipWriter archive;
  for (const auto& [name, bytes] : members) archive.add(name, bytes);
  std::string result;
  archive.write([&result](std::string_view piece) { result += piece; });
  return result;
}

inline const char* kRelationshipsForTests =
    "<Relationships xmlns=\"http://schemas.openxmlformats.org/package/2006/relationships\"><Relationship "
    "Id=\"a\" "
    "Type=\"http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel\" "
    "Target=\"/3D/3dmodel.model\"/></Relationships>";

/// A .3mf file with this text as its model.
inline std::string three_mf_of(const std::string& model) {
  return zip_of({{"_rels/.rels", kRelationshipsForTests}, {"3D/3dmodel.model", model}});
}

/// The text of a model with these resources and items.
inline std::string model_of(const std::string& resources, const std::string& items,
                            const std::string& attributes = "") {
  return "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<model "
         "xmlns=\"http://schemas.microsoft.com/3dmanufacturing/core/2015/02\" " +
         attributes + ">\n<resources>\n" + resources + "\n</resources>\n<build>" + items +
         "</build>\n</model>\n";
}

}  // namespace hermesh
