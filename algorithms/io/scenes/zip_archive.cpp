// The format is PKWARE's APPNOTE 6.3; zlib packs and unpacks.
#define ZLIB_CONST  // const input pointers
#include "algorithms/io/scenes/zip_archive.h"

#include <zlib.h>

#include <new>

namespace hermesh::mesh_formats {

namespace {

// Signatures of the four structures, and their lengths without names and comments.
constexpr std::string_view kLocal("PK\3\4", 4), kEntry("PK\1\2", 4), kEnd("PK\5\6", 4), kEnd64("PK\6\6", 4);
constexpr std::uint64_t kLocalSize = 30, kEntrySize = 46, kEndSize = 22, kLocatorSize = 20, kEnd64Size = 56;
constexpr std::uint64_t kMost = 0xffffffff;
// 1 January 1980, the zero of its calendar.
constexpr std::uint32_t kDate = 1 << 5 | 1;

/// The name in small letters, since packages compare names without regard to case.
std::string lower(std::string_view name) {
  if (name.starts_with('/')) name.remove_prefix(1);
  std::string result(name);
  for (char& c : result)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return result;
}

/// Unpacks a member whose length is known. @returns false where the data are not of that length, or damaged.
bool unpack(std::string_view packed, std::string& bytes) {
  z_stream stream = {};
  if (inflateInit2(&stream, -15) != Z_OK) throw std::bad_alloc();  // negative: no header
  constexpr std::size_t most = std::size_t(1) << 30;               // zlib counts in 32 bits
  std::size_t used = 0;
  int status = Z_OK;
  while (status == Z_OK) {
    stream.next_in = reinterpret_cast<const Bytef*>(packed.data());
    stream.avail_in = static_cast<uInt>(std::min(packed.size(), most));
    stream.next_out = reinterpret_cast<Bytef*>(bytes.data() + used);
    stream.avail_out = static_cast<uInt>(std::min(bytes.size() - used, most));
    const uInt in = stream.avail_in, out = stream.avail_out;
    status = inflate(&stream, Z_NO_FLUSH);
    packed.remove_prefix(in - stream.avail_in);
    used += out - stream.avail_out;
  }
  inflateEnd(&stream);
  return status == Z_STREAM_END && used == bytes.size();
}

/// The checksum of bytes that follow those of which `before` is the checksum.
std::uint32_t checksum_of(std::string_view bytes, std::uint32_t before = 0) {
  return static_cast<std::uint32_t>(
      crc32_z(before, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

}  // namespace

bool begins_like_zip(std::string_view bytes) { return bytes.starts_with(kLocal) || bytes.starts_with(kEnd); }

std::uint64_t ZipArchive::number(std::uint64_t at, int bytes) const {
  // Little-endian, at any address. Whoever calls has seen that the bytes are there.
  std::uint64_t value = 0;
  for (int i = bytes - 1; i >= 0; --i)
    value = value << 8 | static_cast<unsigned char>(bytes_[at + std::uint64_t(i)]);
  return value;
}

ZipArchive::ZipArchive(std::string_view bytes, const MeshBuilder& builder)
    : bytes_(bytes), builder_(builder) {
  // The directory ends the file, but for a comment of 65535 bytes at most.
  const std::uint64_t size = bytes_.size();
  const std::uint64_t last = size < kEndSize ? std::string_view::npos : bytes_.rfind(kEnd, size - kEndSize);
  if (last == std::string_view::npos || size - last > kEndSize + 0xffff)
    builder_.fail("the file is truncated: the directory at the end of its ZIP archive is missing");
  // How many entries there are, and where the first one is.
  std::uint64_t count = number(last + 10, 2), start = number(last + 16, 4);
  // Archives beyond 4 GB, and writers that do not know the length beforehand, say more before the end.
  if ((count == 0xffff || start == kMost) && last >= kLocatorSize + kEnd64Size) {
    const std::uint64_t at = number(last - kLocatorSize + 8, 8);
    if (at > size - kEnd64Size || bytes_.substr(at, 4) != kEnd64)
      builder_.fail("the directory of its ZIP archive is damaged");
    count = number(at + 32, 8), start = number(at + 48, 8);
  }
  for (std::uint64_t i = 0; i < count; ++i) read_entry(start);
}

void ZipArchive::read_entry(std::uint64_t& at) {
  const auto damaged = [&] { builder_.fail("the directory of its ZIP archive is damaged"); };
  if (at > bytes_.size() || bytes_.size() - at < kEntrySize || bytes_.substr(at, 4) != kEntry) damaged();
  // Lengths of what follows the fixed part of the entry.
  const std::uint64_t name = number(at + 28, 2), extra = number(at + 30, 2), comment = number(at + 32, 2);
  if (bytes_.size() - at - kEntrySize < name + extra + comment) damaged();
  Entry entry = {.name = lower(bytes_.substr(at + kEntrySize, name)),
                 .flags = static_cast<std::uint32_t>(number(at + 8, 2)),
                 .method = static_cast<std::uint32_t>(number(at + 10, 2)),
                 .checksum = static_cast<std::uint32_t>(number(at + 16, 4)),
                 .packed = number(at + 20, 4),
                 .size = number(at + 24, 4),
                 .offset = number(at + 42, 4)};
  // Fields of 64 bits stand in an extra field of kind 1, in this order, each only where its place is full.
  for (std::uint64_t field = at + kEntrySize + name, end = field + extra; end - field >= 4;) {
    const std::uint64_t kind = number(field, 2), length = number(field + 2, 2);
    field += 4;
    if (length > end - field) break;
    std::uint64_t from = field;
    field += length;
    if (kind != 1) continue;
    for (std::uint64_t* const value : {&entry.size, &entry.packed, &entry.offset}) {
      if (*value != kMost) continue;
      if (field - from < 8) damaged();
      *value = number(from, 8);
      from += 8;
    }
  }
  entries_.push_back(std::move(entry));
  at += kEntrySize + name + extra + comment;
}

const ZipArchive::Entry* ZipArchive::find(std::string_view name) const {
  const std::string wanted = lower(name);
  for (const Entry& entry : entries_)
    if (entry.name == wanted) return &entry;
  return nullptr;
}

std::string_view ZipArchive::packed_bytes(const Entry& entry) const {
  const std::uint64_t size = bytes_.size(), at = entry.offset;
  const std::string name = quoted_word(entry.name);
  if (at > size || size - at < kLocalSize || bytes_.substr(at, 4) != kLocal)
    builder_.fail("its member " + name + " is not where its ZIP directory says; the file is damaged");
  // Name and extra field stand here once more, and the latter may be of another length.
  const std::uint64_t head = kLocalSize + number(at + 26, 2) + number(at + 28, 2);
  if (size - at < head || size - at - head < entry.packed)
    builder_.fail("its member " + name +
                  " reaches beyond the end of the file, which is truncated or damaged");
  return bytes_.substr(at + head, entry.packed);
}

std::string ZipArchive::member(std::string_view name) const {
  const Entry* const entry = find(name);
  const std::string shown = quoted_word(name);
  if (!entry) builder_.fail("it has no member " + shown + "; the file is damaged or of another kind");
  if (entry->flags & 1) builder_.fail("its member " + shown + " is encrypted, which is not read");
  if (entry->method != 0 && entry->method != 8)
    builder_.fail("its member " + shown + " is packed by method " + std::to_string(entry->method) +
                  ", which is not read; pack it by deflate");
  const std::string_view packed = packed_bytes(*entry);
  // Before a byte is taken: deflate packs 1032 bytes into one at best, and a stored member is as long as it
  // is.
  if (entry->method == 0 ? entry->size != packed.size() : entry->size / 1032 > packed.size())
    builder_.fail("its member " + shown + " declares a length that it cannot have; the file is damaged");
  if (entry->size > memory_limit())
    builder_.fail("its member " + shown + " unpacks to more than half of the memory there is");
  std::string bytes;
  if (entry->method == 0) {
    bytes = packed;
  } else {
    bytes.resize(entry->size);
    if (!unpack(packed, bytes))
      builder_.fail("its member " + shown + " does not unpack; the file is damaged");
  }
  // What was unpacked without complaint may still be of another file.
  if (checksum_of(bytes) != entry->checksum)
    builder_.fail("its member " + shown +
                  " has another checksum than its ZIP archive says; the file is damaged");
  return bytes;
}

struct ZipWriter::Impl {
  z_stream stream = {};
  bool open = false;
  std::string name, packed;
  std::uint32_t checksum = 0;
  std::uint64_t size = 0, offset = 0, count = 0;  ///< of the open member, of all before it, and their number
  std::vector<std::string> pieces;
  std::string directory;
};

ZipWriter::ZipWriter() : impl_(new Impl) {}
ZipWriter::~ZipWriter() {
  if (impl_->open) deflateEnd(&impl_->stream);
  delete impl_;
}

namespace {

/// Appends a number of so many bytes, of which there may be more than it has, little-endian.
void put(std::string& to, std::uint64_t value, int bytes) {
  for (int i = 0; i < bytes; ++i, value >>= 8) to += static_cast<char>(value & 0xff);
}

/// Packs bytes, and appends what comes out.
void run_deflate(z_stream& stream, std::string_view bytes, std::string& packed, int flush) {
  std::array<char, 1 << 15> room;
  stream.next_in = reinterpret_cast<const Bytef*>(bytes.data());
  stream.avail_in = static_cast<uInt>(bytes.size());
  // Until there is room left, which says that nothing waits any more.
  do {
    stream.next_out = reinterpret_cast<Bytef*>(room.data());
    stream.avail_out = static_cast<uInt>(room.size());
    deflate(&stream, flush);
    packed.append(room.data(), room.size() - stream.avail_out);
  } while (stream.avail_out == 0);
}

}  // namespace

void ZipWriter::begin(std::string name) {
  end_member();
  impl_->name = std::move(name);
  impl_->stream = {};
  if (deflateInit2(&impl_->stream, 6, Z_DEFLATED, -15, 8, Z_DEFAULT_STRATEGY) != Z_OK) throw std::bad_alloc();
  impl_->open = true;
  // The fields are those of the member that begins; offset and count go on.
  impl_->checksum = 0, impl_->size = 0;
  impl_->packed.clear();
}

void ZipWriter::add(std::string_view bytes) {
  impl_->checksum = checksum_of(bytes, impl_->checksum);
  impl_->size += bytes.size();
  run_deflate(impl_->stream, bytes, impl_->packed, Z_NO_FLUSH);
  if (impl_->size > kMost || impl_->offset + impl_->packed.size() > kMost - (1 << 20))
    throw Error("it would be longer than the 4 GB that a ZIP archive without extensions holds");
}

void ZipWriter::end_member() {
  if (!impl_->open) return;
  run_deflate(impl_->stream, {}, impl_->packed, Z_FINISH);
  deflateEnd(&impl_->stream);
  impl_->open = false;
  // What stands in both structures: version 2.0, no flags, deflate, time and date, checksum, lengths, and
  // that of the name.
  std::string common;
  put(common, 20, 2), put(common, 0, 2), put(common, 8, 2), put(common, 0, 2), put(common, kDate, 2);
  put(common, impl_->checksum, 4), put(common, impl_->packed.size(), 4), put(common, impl_->size, 4);
  put(common, impl_->name.size(), 2), put(common, 0, 2);
  impl_->pieces.push_back(std::string(kLocal) + common + impl_->name);
  std::string& directory = impl_->directory;
  directory += kEntry;
  put(directory, 20, 2);
  directory += common;
  // No comment, the first disk, no attributes.
  put(directory, 0, 10), put(directory, impl_->offset, 4);
  directory += impl_->name;
  impl_->offset += impl_->pieces.back().size() + impl_->packed.size();
  impl_->pieces.push_back(std::move(impl_->packed));
  ++impl_->count;
}

std::vector<std::string> ZipWriter::finish() {
  end_member();
  std::string end = std::move(impl_->directory);
  // One disk, on which all entries are.
  const std::uint64_t size = end.size();
  end += kEnd;
  put(end, 0, 4), put(end, impl_->count, 2), put(end, impl_->count, 2), put(end, size, 4),
      put(end, impl_->offset, 4);
  put(end, 0, 2);
  impl_->pieces.push_back(std::move(end));
  return std::move(impl_->pieces);
}

}  // namespace hermesh::mesh_formats
