#include <openssl/evp.h>

#include <bit>
#include <fstream>
#include <memory>
#include <stdexcept>
#include <vector>

#include "experiments/cases/cases.h"

namespace hermesh {

namespace {

static_assert(std::endian::native == std::endian::little, "the arrays are hashed as they lie in memory");

class Sha256 {
 public:
  Sha256() : context_(EVP_MD_CTX_new(), EVP_MD_CTX_free) {
    check(context_ && EVP_DigestInit_ex(context_.get(), EVP_sha256(), nullptr));
  }
  void add(const void* bytes, std::size_t size) { check(EVP_DigestUpdate(context_.get(), bytes, size)); }
  template <class Array>
  void add_array(const Array& items) {
    add(items.data(), items.size() * sizeof(items[0]));
  }
  std::string hex() {
    unsigned char digest[EVP_MAX_MD_SIZE];
    unsigned size = 0;
    check(EVP_DigestFinal_ex(context_.get(), digest, &size));
    std::string text;
    for (unsigned i = 0; i < size; ++i) {
      text += "0123456789abcdef"[digest[i] >> 4];
      text += "0123456789abcdef"[digest[i] & 15];
    }
    return text;
  }

 private:
  static void check(bool done) {
    if (!done) throw std::runtime_error("SHA-256 failed");
  }
  std::unique_ptr<EVP_MD_CTX, void (*)(EVP_MD_CTX*)> context_;
};

}  // namespace

std::string sha256_of_file(const std::filesystem::path& path) {
  std::ifstream stream(path, std::ios::binary);
  Sha256 hash;
  std::vector<char> buffer(1 << 20);
  while (stream.read(buffer.data(), static_cast<std::streamsize>(buffer.size())) || stream.gcount() > 0)
    hash.add(buffer.data(), static_cast<std::size_t>(stream.gcount()));
  if (!stream.eof()) throw Error("cannot read " + path.string());
  return hash.hex();
}

std::string sha256_of_text(std::string_view text) {
  Sha256 hash;
  hash.add_array(text);
  return hash.hex();
}

std::string sha256_of_mesh(const PolygonMesh& mesh) {
  Sha256 hash;
  const std::vector<std::uint64_t> counts = {mesh.points.size(), mesh.triangles.size(), mesh.quads.size()};
  hash.add_array(counts);
  hash.add(mesh.origin.data(), 3 * sizeof(double));
  hash.add_array(mesh.points);
  hash.add_array(mesh.triangles);
  hash.add_array(mesh.quads);
  return hash.hex();
}

}  // namespace hermesh
