// glTF and 3MF files made by hand, for tests.
#pragma once

#include "algorithms/io/scenes/zip_archive.h"
#include "algorithms/io/test_mesh_files.h"

namespace hermesh {

/// Returns a .glb file of these chunks; without a second one if it is empty.
inline std::string glb_of(std::string json, std::string binary) {
  while (json.size() % 4 != 0) json += ' ';
  while (binary.size() % 4 != 0) binary += '\0';
  const std::size_t size = 20 + json.size() + (binary.empty() ? 0 : 8 + binary.size());
  std::string bytes = "glTF" + raw(std::uint32_t(2)) + raw(std::uint32_t(size)) +
                      raw(std::uint32_t(json.size())) + "JSON" + json;
  if (!binary.empty()) bytes += raw(std::uint32_t(binary.size())) + std::string("BIN\0", 4) + binary;
  return bytes;
}

inline std::string zip_of(const std::vector<std::pair<std::string, std::string>>& members) {
  mesh_formats::ZipWriter archive;
  for (const auto& [name, bytes] : members) {
    archive.begin(name, double(bytes.size()));
    archive.write(bytes);
  }
  return archive.finish();
}

inline const char* kRelationshipsForTests =
    "<Relationships xmlns=\"http://schemas.openxmlformats.org/package/2006/relationships\"><Relationship "
    "Id=\"a\" "
    "Type=\"http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel\" "
    "Target=\"/3D/3dmodel.model\"/></Relationships>";

/// Returns a .3mf file with this text as its model.
inline std::string three_mf_of(const std::string& model) {
  return zip_of({{"_rels/.rels", kRelationshipsForTests}, {"3D/3dmodel.model", model}});
}

/// Returns the text of a model with these resources and items.
inline std::string model_of(const std::string& resources, const std::string& items,
                            const std::string& attributes = "") {
  return "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<model "
         "xmlns=\"http://schemas.microsoft.com/3dmanufacturing/core/2015/02\" " +
         attributes + ">\n<resources>\n" + resources + "\n</resources>\n<build>" + items +
         "</build>\n</model>\n";
}

}  // namespace hermesh
