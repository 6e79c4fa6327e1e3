#include "algorithms/io/scenes/zip_archive.h"

#include <minizip/unzip.h>
#include <minizip/zip.h>

#include <algorithm>
#include <cstring>
#include <new>

#include "algorithms/io/stored_number.h"

namespace hermesh::mesh_formats {

namespace {

// 1 January 1980, the zero of the calendar of DOS, in the upper half.
constexpr uLong kDosDate = (1 << 5 | 1) << 16;
// 9 takes four times as long for a thirtieth of the length.
constexpr int kLevel = 6;

ZipStream& stream_at(void* opaque) { return *static_cast<ZipStream*>(opaque); }

uLong read_stream(void* opaque, void*, void* to, uLong size) {
  ZipStream& stream = stream_at(opaque);
  const std::size_t count = stream.in.substr(stream.at).copy(static_cast<char*>(to), size);
  stream.at += count;
  return count;
}

uLong write_stream(void* opaque, void*, const void* from, uLong size) {
  ZipStream& stream = stream_at(opaque);
  try {  // called from C, which no exception may pass through
    stream.out.resize(std::max(stream.out.size(), std::size_t(stream.at + size)));
  } catch (const std::bad_alloc&) {
    return 0;
  }
  std::memcpy(stream.out.data() + stream.at, from, size);
  stream.at += size;
  return size;
}

long seek_stream(void* opaque, void*, ZPOS64_T offset, int origin) {
  ZipStream& stream = stream_at(opaque);
  const std::uint64_t base = origin == ZLIB_FILEFUNC_SEEK_SET   ? 0
                             : origin == ZLIB_FILEFUNC_SEEK_CUR ? stream.at
                                                                : stream.size();
  if (offset > stream.size() - base) return -1;
  stream.at = base + offset;
  return 0;
}

zlib_filefunc64_def functions_of(ZipStream& stream) {
  return {.zopen64_file = [](void* opaque, const void*, int) { return opaque; },
          .zread_file = read_stream,
          .zwrite_file = write_stream,
          .ztell64_file = [](void* opaque, void*) -> ZPOS64_T { return stream_at(opaque).at; },
          .zseek64_file = seek_stream,
          .zclose_file = [](void*, void*) { return 0; },
          .zerror_file = [](void*, void*) { return 0; },
          .opaque = &stream};
}

/// The bytes up to the comment of the archive. minizip takes the last mark of an end for the end, but a
/// comment may contain such marks, even a whole archive. So the first mark whose comment ends with the file
/// decides, or else, where something follows the archive, the last one.
std::string_view without_comment(std::string_view bytes) {
  constexpr std::size_t kEnd = 22, kReach = kEnd + 65'535;
  std::size_t last = 0;
  for (std::size_t at = bytes.find("PK\5\6", bytes.size() - std::min(bytes.size(), kReach));
       at != bytes.npos && at + kEnd <= bytes.size(); at = bytes.find("PK\5\6", at + 4)) {
    last = at + kEnd;
    if (last + stored_number<std::uint16_t>(bytes.data() + at + 20) == bytes.size()) break;
  }
  return bytes.substr(0, last);
}

}  // namespace

bool begins_like_zip(std::string_view bytes) {
  return bytes.starts_with("PK\3\4") || bytes.starts_with("PK\5\6");
}

void ZipArchive::Close::operator()(void* archive) const { unzClose(archive); }

ZipArchive::ZipArchive(std::string_view bytes, const MeshBuilder& builder)
    : builder_(builder), stream_{without_comment(bytes), {}} {
  zlib_filefunc64_def functions = functions_of(stream_);
  archive_.reset(unzOpen2_64(nullptr, &functions));
  unz_global_info64 all{};
  int status = archive_ ? unzGetGlobalInfo64(archive_.get(), &all) : UNZ_BADZIPFILE;
  if (status == UNZ_OK)
    status = all.number_entry == 0 ? UNZ_END_OF_LIST_OF_FILE : unzGoToFirstFile(archive_.get());
  for (; status == UNZ_OK; status = unzGoToNextFile(archive_.get())) {
    unz_file_info64 info;
    unz64_file_pos at;
    const auto get = [&](char* name, uLong size) {
      return unzGetCurrentFileInfo64(archive_.get(), &info, name, size, nullptr, 0, nullptr, 0) == UNZ_OK;
    };
    if (!get(nullptr, 0) || unzGetFilePos64(archive_.get(), &at) != UNZ_OK) break;
    std::string name(info.size_filename, '\0');
    if (!get(name.data(), info.size_filename)) break;
    if (name.starts_with('/')) name.erase(0, 1);
    // Of two members of one name the first counts.
    const Entry entry = {at.pos_in_zip_directory, at.num_of_file};
    entries_.emplace(name, entry);
    lower_entries_.emplace(lower_case(name), entry);
  }
  if (status != UNZ_END_OF_LIST_OF_FILE)
    builder_.fail("the file is truncated or damaged: the directory at the end of its ZIP archive is invalid");
}

const ZipArchive::Entry* ZipArchive::find(std::string name) const {
  if (name.starts_with('/')) name.erase(0, 1);
  if (const auto found = entries_.find(name); found != entries_.end()) return &found->second;
  const auto found = lower_entries_.find(lower_case(name));
  return found == lower_entries_.end() ? nullptr : &found->second;
}

void ZipArchive::fail(const std::string& what) const { builder_.fail("its member ", shown_, " ", what); }

void ZipArchive::open(const std::string& name) {
  shown_ = quoted_word(name);
  const Entry* const entry = find(name);
  if (!entry) builder_.fail("it has no member ", shown_, "; the file is damaged or of another kind");
  const unz64_file_pos at = {entry->position, entry->number};
  unz_file_info64 info;
  if (unzGoToFilePos64(archive_.get(), &at) != UNZ_OK ||
      unzGetCurrentFileInfo64(archive_.get(), &info, nullptr, 0, nullptr, 0, nullptr, 0) != UNZ_OK)
    fail("cannot be read; the file is damaged");
  const bool stored = info.compression_method == 0;
  if (info.flag & 1) fail("is encrypted, which is not read");
  if (!stored && info.compression_method != Z_DEFLATED)
    fail(joined("is packed by method ", info.compression_method, ", which is not read; pack it by deflate"));
  if (info.compressed_size > stream_.size())
    fail("reaches beyond the end of the file, which is truncated or damaged");
  // Deflate packs at most 1032 bytes into one.
  if (stored ? info.uncompressed_size != info.compressed_size
             : info.uncompressed_size / 1032 > info.compressed_size)
    fail("declares an impossible length; the file is damaged");
  // Summed over all members, since many may share their packed bytes.
  opened_ += info.uncompressed_size;
  check_unpacked(stream_.size(), opened_, in_quotes(builder_.file()));
  size_ = info.uncompressed_size, done_ = 0;
  is_open_ = unzOpenCurrentFile(archive_.get()) == UNZ_OK;
  if (!is_open_) fail("does not agree with its entry in the ZIP directory; the file is damaged");
}

std::size_t ZipArchive::read(std::span<char> room) {
  if (!is_open_) return 0;
  // minizip gives no more bytes than the directory declares; data that go on have another checksum.
  const int count = unzReadCurrentFile(archive_.get(), room.data(), static_cast<unsigned>(room.size()));
  if (count < 0 || (count == 0 && done_ < size_)) fail("does not unpack; the file is damaged");
  done_ += static_cast<std::uint64_t>(count);
  if (count > 0) return static_cast<std::size_t>(count);
  is_open_ = false;
  if (unzCloseCurrentFile(archive_.get()) != UNZ_OK)
    fail("has another checksum than its ZIP directory states; the file is damaged");
  return 0;
}

void ZipWriter::Close::operator()(void* archive) const { zipClose(archive, nullptr); }

ZipWriter::ZipWriter() {
  zlib_filefunc64_def functions = functions_of(stream_);
  archive_.reset(zipOpen2_64(nullptr, APPEND_STATUS_CREATE, nullptr, &functions));
  if (!archive_) throw std::bad_alloc();
}

// All that can fail while an archive is written to memory is an allocation.

void ZipWriter::begin(const std::string& name, double at_most) {
  const zip_fileinfo times = {.tmz_date = {}, .dosDate = kDosDate, .internal_fa = 0, .external_fa = 0};
  if (zipOpenNewFileInZip64(archive_.get(), name.c_str(), &times, nullptr, 0, nullptr, 0, nullptr, Z_DEFLATED,
                            kLevel, at_most >= 0xffffffff) != ZIP_OK)
    throw std::bad_alloc();
}

void ZipWriter::write(std::string_view bytes) {
  if (zipWriteInFileInZip(archive_.get(), bytes.data(), static_cast<unsigned>(bytes.size())) != ZIP_OK)
    throw std::bad_alloc();
}

std::string ZipWriter::finish() {
  if (zipClose(archive_.release(), nullptr) != ZIP_OK) throw std::bad_alloc();
  return std::move(stream_.out);
}

}  // namespace hermesh::mesh_formats
