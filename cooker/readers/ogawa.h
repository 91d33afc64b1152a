// SPDX-License-Identifier: MIT
// Ogawa, the container of Alembic files: groups of positions, and blocks of bytes. Nothing in it is believed
// before it has been held against the size of the file.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "common/mesh.h"

namespace rill::cooker {

class OgawaFile {
public:
    struct Node {
        uint64_t position = 0;  ///< of the group or the block in the file; 0: empty
        bool is_data = false;
    };
    explicit OgawaFile(const std::filesystem::path& path);  ///< throws InputError
    ~OgawaFile();
    OgawaFile(const OgawaFile&) = delete;
    Node root() const { return root_; }
    std::vector<Node> group(Node node, const char* what) const;
    /// The bytes of a block. `skip`: of them left out at its begin (none are left when it is shorter).
    std::string data(Node node, const char* what, uint64_t skip = 0) const;
    uint64_t size() const { return size_; }
    const std::string& name() const { return name_; }
    [[noreturn]] void fail(const std::string& cause) const { throw InputError(name_ + ": " + cause); }

private:
    void read(uint64_t position, void* to, uint64_t count, const char* what) const;
    uint64_t number(uint64_t position, const char* what) const;
    std::string name_;
    int file_ = -1;
    uint64_t size_ = 0;
    Node root_;
};

}  // namespace rill::cooker
