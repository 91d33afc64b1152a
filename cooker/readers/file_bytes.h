// SPDX-License-Identifier: MIT
// Whole files in, and a bounded little-endian cursor over them: the only way readers move through bytes.
#pragma once
#include <bit>
#include <cstring>
#include <filesystem>
#include <type_traits>

#include "common/mesh.h"

namespace rill::cooker {

static_assert(std::endian::native == std::endian::little, "readers copy little-endian values as they are");

/// Throws InputError naming the file when it cannot be read whole.
std::string read_file(const std::filesystem::path& path);
/// The content of a gzip file. Throws InputError when it is none, damaged, or ends early.
std::string read_gzip(const std::filesystem::path& path);

class ByteCursor {
public:
    ByteCursor(const std::string& bytes, std::string name) : bytes_(bytes), name_(std::move(name)) {}
    size_t left() const { return bytes_.size() - at_; }
    size_t at() const { return at_; }
    [[noreturn]] void fail(const std::string& cause) const { throw InputError(name_ + ": " + cause); }
    void skip(size_t count) { need(count, "data"), at_ += count; }

    template <class T>
    T take(const char* what) {
        static_assert(std::is_trivially_copyable_v<T>);
        need(sizeof(T), what);
        T value;
        std::memcpy(&value, bytes_.data() + at_, sizeof(T));
        at_ += sizeof(T);
        return value;
    }
    /// A count that the file states as int32; `each` bytes must follow for every one.
    size_t count(const char* what, size_t each) {
        const int32_t value = take<int32_t>(what);
        if (value < 0) fail("states " + std::to_string(value) + " " + what);
        if (size_t(value) > left() / each)
            fail("states " + std::to_string(value) + " " + what + " at byte " + std::to_string(at_ - 4) + " but only " +
                 std::to_string(left()) + " bytes follow");
        return size_t(value);
    }
    /// `count` values of 12 bytes: three floats or three indices.
    template <class T>
    std::vector<T> triples(size_t count, const char* what) {
        static_assert(sizeof(T) == 12 && std::is_trivially_copyable_v<T>);
        need(count * 12, what);
        std::vector<T> values(count);
        if (count > 0) std::memcpy(static_cast<void*>(values.data()), bytes_.data() + at_, count * 12);
        at_ += count * 12;
        return values;
    }

private:
    void need(size_t count, const char* what) const {
        if (count > left())
            fail("ends at byte " + std::to_string(bytes_.size()) + " in the middle of its " + what);
    }
    const std::string& bytes_;
    std::string name_;
    size_t at_ = 0;
};

}  // namespace rill::cooker
