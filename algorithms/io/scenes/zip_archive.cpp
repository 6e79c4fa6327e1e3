#include "algorithms/io/scenes/zip_archive.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <new>
#include <utility>

namespace hermesh::mesh_formats {

namespace {

// 1 January 1980, the zero of its calendar.
constexpr std::uint16_t kDate = 1 << 5 | 1;
// The library's own default is 9, which takes four times as long for a thirtieth of the length.
constexpr int kLevel = 6;
constexpr std::size_t kPackedPiece = std::size_t(1) << 16;

struct FreeSource {
  void operator()(zip_source_t* source) const { zip_source_free(source); }
};
using Source = std::unique_ptr<zip_source_t, FreeSource>;

/// What the library says about a failure; where memory was short, that is the failure, as anywhere else.
std::string words_of(zip_error_t& error) {
  if (zip_error_code_zip(&error) == ZIP_ER_MEMORY) throw std::bad_alloc();
  return zip_error_strerror(&error);
}

/// Marks of an archive's end where one may lie: before a comment of up to 65,535 bytes. The library reads the
/// whole directory for each of them.
std::size_t marks_of_end(std::string_view bytes) {
  constexpr std::size_t kReach = 22 + 65'535;
  bytes.remove_prefix(bytes.size() - std::min(bytes.size(), kReach));
  std::size_t marks = 0;
  for (std::size_t at = bytes.find("PK\5\6"); at != bytes.npos; at = bytes.find("PK\5\6", at + 4)) ++marks;
  return marks;
}

}  // namespace

bool begins_like_zip(std::string_view bytes) {
  // The head of a member, or the end of an archive that has none.
  return bytes.starts_with("PK\3\4") || bytes.starts_with("PK\5\6");
}

ZipArchive::ZipArchive(std::string_view bytes, const MeshBuilder& builder)
    : bytes_(bytes.size()), builder_(builder) {
  // One is the rule, and a comment may hold an archive of its own; thousands are there to take time.
  constexpr std::size_t kMostMarks = 16;
  if (marks_of_end(bytes) > kMostMarks)
    builder_.fail("the directory of its ZIP archive has more ends than one; the file is damaged");
  zip_error_t error;
  zip_error_init(&error);
  Source source(zip_source_buffer_create(bytes.data(), bytes.size(), 0, &error));
  if (!source) throw std::bad_alloc();
  archive_.reset(zip_open_from_source(source.get(), ZIP_RDONLY, &error));
  if (!archive_) {
    words_of(error);
    builder_.fail(
        "the file is truncated or damaged: the directory at the end of its ZIP archive cannot be read");
  }
  // It belongs to the archive from here on.
  source.release();
}

zip_int64_t ZipArchive::find(std::string name) const {
  if (name.starts_with('/')) name.erase(0, 1);
  // The exact name is looked up at once; a search in letters of either case goes through all names.
  for (const zip_flags_t how : {zip_flags_t(0), zip_flags_t(ZIP_FL_NOCASE)})
    for (const std::string& each : {name, '/' + name})
      if (const zip_int64_t found = zip_name_locate(archive_.get(), each.c_str(), how); found >= 0)
        return found;
  return -1;
}

void ZipArchive::check(const zip_stat_t& entry, const std::string& shown) {
  if (entry.encryption_method != ZIP_EM_NONE)
    builder_.fail("its member " + shown + " is encrypted, which is not read");
  if (entry.comp_method != ZIP_CM_STORE && entry.comp_method != ZIP_CM_DEFLATE)
    builder_.fail("its member " + shown + " is packed by method " + std::to_string(entry.comp_method) +
                  ", which is not read; pack it by deflate");
  if (entry.comp_size > bytes_)
    builder_.fail("its member " + shown +
                  " reaches beyond the end of the file, which is truncated or damaged");
  // Deflate packs 1032 bytes into one at best, and a stored member is as long as it is.
  if (entry.comp_method == ZIP_CM_STORE ? entry.size != entry.comp_size : entry.size / 1032 > entry.comp_size)
    builder_.fail("its member " + shown + " declares a length that it cannot have; the file is damaged");
  // Of all members that are read, since many may share their packed bytes.
  opened_ += entry.size;
  check_unpacked(bytes_, opened_, in_quotes(builder_.file()));
}

ZipMember ZipArchive::open(const std::string& name) {
  ZipMember member;
  member.builder_ = &builder_;
  member.shown_ = quoted_word(name);
  const zip_int64_t found = find(name);
  zip_stat_t entry;
  if (found < 0 || zip_stat_index(archive_.get(), static_cast<zip_uint64_t>(found), 0, &entry) != 0)
    builder_.fail("it has no member " + member.shown_ + "; the file is damaged or of another kind");
  check(entry, member.shown_);
  member.size_ = entry.size;
  member.file_.reset(zip_fopen_index(archive_.get(), static_cast<zip_uint64_t>(found), 0));
  if (member.file_) return member;
  words_of(*zip_get_error(archive_.get()));
  builder_.fail("its member " + member.shown_ + " is not where its ZIP directory says; the file is damaged");
}

std::size_t ZipMember::read(std::span<char> room) {
  const zip_int64_t count = zip_fread(file_.get(), room.data(), room.size());
  if (count < 0) {
    zip_error_t& error = *zip_file_get_error(file_.get());
    words_of(error);
    fail(zip_error_code_zip(&error));
  }
  done_ += static_cast<std::uint64_t>(count);
  // The library compares the lengths at the end alone, and a few bytes may unpack to very many.
  if (done_ > size_ || (count == 0 && done_ < size_)) fail(ZIP_ER_INCONS);
  return static_cast<std::size_t>(count);
}

void ZipMember::fail(int code) const {
  // What was unpacked without complaint may still be of another file.
  builder_->fail(
      "its member " + shown_ +
      (code == ZIP_ER_CRC ? " has another checksum than its ZIP archive says" : " does not unpack") +
      "; the file is damaged");
}

void ZipWriter::add(std::string name, std::uint64_t size, Pieces pieces) {
  members_.push_back({std::move(name), size, std::move(pieces)});
}

void ZipWriter::add(std::string name, std::string bytes) {
  const std::uint64_t size = bytes.size();
  add(std::move(name), size, [bytes = std::move(bytes), given = false]() mutable {
    return std::exchange(given, true) ? std::string_view() : std::string_view(bytes);
  });
}

/// Copies the next bytes of a member. The library calls from C, which no exception may pass through.
zip_int64_t ZipWriter::give(Member& member, char* room, std::uint64_t size) {
  try {
    if (member.rest.empty()) member.rest = member.pieces();
  } catch (...) {
    member.thrown = std::current_exception();
    return -1;
  }
  const std::size_t count = member.rest.copy(room, size);
  member.rest.remove_prefix(count);
  return static_cast<zip_int64_t>(count);
}

/// Answers what the library asks a member.
zip_int64_t ZipWriter::answer(void* of, void* data, zip_uint64_t size, zip_source_cmd_t command) {
  Member& member = *static_cast<Member*>(of);
  constexpr std::array<int, 2> broken = {ZIP_ER_READ, 0};
  switch (command) {
    case ZIP_SOURCE_SUPPORTS:
      return zip_source_make_command_bitmap(ZIP_SOURCE_OPEN, ZIP_SOURCE_READ, ZIP_SOURCE_CLOSE,
                                            ZIP_SOURCE_STAT, ZIP_SOURCE_ERROR, ZIP_SOURCE_FREE, -1);
    case ZIP_SOURCE_READ:
      return give(member, static_cast<char*>(data), size);
    case ZIP_SOURCE_STAT: {
      // Without the length the library would reserve fields of 64 bits, which not every reader knows.
      zip_stat_t& state = *static_cast<zip_stat_t*>(data);
      zip_stat_init(&state);
      state.size = member.size;
      state.valid = ZIP_STAT_SIZE;
      return sizeof state;
    }
    case ZIP_SOURCE_ERROR:
      std::memcpy(data, broken.data(), sizeof broken);
      return sizeof broken;
    default:
      return 0;
  }
}

/// Writes the archive into a source of the library's.
void ZipWriter::pack(zip_source_t* target) {
  zip_error_t error;
  zip_error_init(&error);
  Zip archive(zip_open_from_source(target, ZIP_TRUNCATE, &error));
  if (!archive) throw Error(words_of(error));
  // The archive takes its target along when it goes.
  zip_source_keep(target);
  bool good = true;
  for (Member& member : members_) {
    Source source(zip_source_function(archive.get(), answer, &member));
    const zip_int64_t number =
        source ? zip_file_add(archive.get(), member.name.c_str(), source.get(), ZIP_FL_ENC_UTF_8) : -1;
    const auto index = static_cast<zip_uint64_t>(number);
    if (number >= 0) source.release();
    good = good && number >= 0 &&
           zip_set_file_compression(archive.get(), index, ZIP_CM_DEFLATE, kLevel) == 0 &&
           zip_file_set_dostime(archive.get(), index, 0, kDate, 0) == 0;
  }
  if (good && zip_close(archive.get()) == 0) return void(archive.release());
  for (const Member& member : members_)
    if (member.thrown) std::rethrow_exception(member.thrown);
  throw Error(words_of(*zip_get_error(archive.get())));
}

void ZipWriter::write(const ByteSink& out) {
  zip_error_t error;
  zip_error_init(&error);
  const Source target(zip_source_buffer_create(nullptr, 0, 0, &error));
  if (!target) throw std::bad_alloc();
  pack(target.get());
  std::string piece(kPackedPiece, '\0');
  zip_int64_t count = zip_source_open(target.get());
  while (count >= 0 && (count = zip_source_read(target.get(), piece.data(), piece.size())) > 0)
    out({piece.data(), static_cast<std::size_t>(count)});
  if (count < 0) throw Error(words_of(*zip_source_error(target.get())));
  zip_source_close(target.get());
}

}  // namespace hermesh::mesh_formats
