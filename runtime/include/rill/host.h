// SPDX-License-Identifier: MIT
// A ready-made host for those without an engine: heap memory, a thread pool, file and memory IO.
// Library rill::host; engines that bring their own never link it.
#pragma once
#include "rill/rill.h"

namespace rill {

/// malloc-family, 64-byte alignment honoured.
Memory heap_memory() noexcept;

/// `workers` threads run tasks; the thread in end_frame() helps as worker 0, one at a time (so Jobs::workers = workers + 1).
/// workers 0: everything inline. Out of work, a thread looks out for more for a tenth of a millisecond before it sleeps. Null when threads
/// cannot be started.
struct ThreadPool;
ThreadPool* start_threads(uint32_t workers) noexcept;
Jobs thread_jobs(ThreadPool* pool) noexcept;
void stop_threads(ThreadPool* pool) noexcept;

/// Reads of one file, done on a thread of its own in order of need. Null when it cannot be opened.
struct FileReader;
FileReader* open_file(const char* path, uint64_t* bytes) noexcept;
Io file_io(FileReader* reader) noexcept;
void close_file(FileReader* reader) noexcept;  ///< after close(asset)

/// Reads out of a block in memory (embedded or mapped assets): complete inside begin().
struct MemoryReader {
    const void* data;
    uint64_t bytes;
};
Io memory_io(MemoryReader* reader) noexcept;

}  // namespace rill
