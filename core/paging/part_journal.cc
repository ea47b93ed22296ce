#include "core/paging/part_journal.h"

#include <span>

#include "core/base/status_macros.h"
#include "core/codec/bytes/crc32c.h"

namespace rilievo {
namespace {

struct JournalEntry {
  uint64_t checksum = 0;
  int32_t part = 0;
  uint32_t of_entry = 0;  // CRC-32C of what is before
};
constexpr int64_t kEntryBytes = sizeof(JournalEntry);
static_assert(kEntryBytes == 16);

uint32_t ChecksumOf(const JournalEntry& entry) {
  return Crc32c(
      std::span(reinterpret_cast<const uint8_t*>(&entry), sizeof(entry) - sizeof(entry.of_entry)));
}

}  // namespace

absl::StatusOr<PartJournal> PartJournal::Open(const ScratchFolder& folder,
                                              const std::string& name) {
  RILIEVO_ASSIGN_OR_RETURN(ScratchFile file, ScratchFile::Create(folder, name));
  PartJournal journal(std::move(file));
  int64_t at = 0;
  for (; at + kEntryBytes <= journal.file_.size(); at += kEntryBytes) {
    JournalEntry entry;
    RILIEVO_RETURN_IF_ERROR(journal.file_.ReadAt(at, &entry, sizeof(entry)));
    if (entry.of_entry != ChecksumOf(entry)) break;
    journal.finished_[entry.part] = entry.checksum;
  }
  RILIEVO_RETURN_IF_ERROR(journal.file_.Resize(at));
  return journal;
}

absl::Status PartJournal::Add(int part, uint64_t checksum) {
  JournalEntry entry{checksum, part, 0};
  entry.of_entry = ChecksumOf(entry);
  RILIEVO_RETURN_IF_ERROR(file_.Append(&entry, sizeof(entry)));
  finished_[part] = checksum;
  return absl::OkStatus();
}

}  // namespace rilievo
