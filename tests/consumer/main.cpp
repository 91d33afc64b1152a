// SPDX-License-Identifier: MIT
// The shortest use of Rill: is this file an asset, and what is in it?
#include <cstdio>
#include <vector>

#include <rill/host.h>
#include <rill/rill.h>

int main(int argc, char** argv) {
    std::FILE* file = argc == 2 ? std::fopen(argv[1], "rb") : nullptr;
    if (!file) return 1;
    std::vector<unsigned char> bytes;
    for (int c; (c = std::fgetc(file)) != EOF;) bytes.push_back(static_cast<unsigned char>(c));
    std::fclose(file);

    rill::Host host;
    host.memory = rill::heap_memory();
    rill::MemoryReader reader{bytes.data(), bytes.size()};
    rill::Asset* asset = nullptr;
    rill::AssetInfo info{};
    rill::Status status = rill::open(host, rill::memory_io(&reader), bytes.size(), &asset);
    if (status == rill::Status::ok) {
        do status = rill::poll(asset, &info);
        while (status == rill::Status::pending);
        while (rill::close(asset) == rill::Status::pending) {}
    }
    std::printf("status %d: %s; %u frames\n", static_cast<int>(status), rill::text(status), info.frames);
}
