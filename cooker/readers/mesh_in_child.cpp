// SPDX-License-Identifier: MIT
#include "readers/mesh_in_child.h"

#include <poll.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <fstream>
#include <mutex>

namespace rill::cooker {
namespace {

using Clock = std::chrono::steady_clock;

constexpr size_t longest_cause = 300;  // of what a library says of a damaged file: it may quote from it at length
constexpr const char* too_long = "reading takes too long";

/// The process's own end of a pipe; closed when it goes.
struct End {
    int file = -1;
    Clock::time_point deadline = Clock::time_point::max();  // for get
    ~End() { close(); }
    void close() {
        if (file >= 0) ::close(file);
        file = -1;
    }
    bool put(const void* data, size_t size) const {
        const char* at = static_cast<const char*>(data);
        while (size > 0) {
            const ssize_t done = ::write(file, at, size);
            if (done < 0 && errno == EINTR) continue;
            if (done <= 0) return false;
            at += done, size -= size_t(done);
        }
        return true;
    }
    bool get(void* data, size_t size) const {
        char* at = static_cast<char*>(data);
        while (size > 0) {
            if (!comes()) return false;
            const ssize_t done = ::read(file, at, size);
            if (done < 0 && errno == EINTR) continue;
            if (done <= 0) return false;
            at += done, size -= size_t(done);
        }
        return true;
    }
    bool late() const { return Clock::now() >= deadline; }
    /// Waits until there is something to read, or the end.
    bool comes() const {
        for (pollfd poll{file, POLLIN, 0}; !late();)
            if (::poll(&poll, 1, 100) > 0) return true;
        return false;
    }
    template <class T>
    bool put_all(const std::vector<T>& items) const {
        const uint64_t count = items.size();
        return put(&count, sizeof count) && put(items.data(), count * sizeof(T));
    }
    template <class T>
    bool get_all(std::vector<T>& items) const {
        uint64_t count = 0;
        if (!get(&count, sizeof count)) return false;
        items.resize(count);
        return get(items.data(), count * sizeof(T));
    }
};

void limit(int resource, uint64_t most) {
    rlimit now{};
    if (getrlimit(resource, &now) != 0) return;
    now.rlim_cur = std::min<rlim_t>(now.rlim_max, most);
    setrlimit(resource, &now);
}
uint64_t data_bytes() {  // held by this process
    std::ifstream file("/proc/self/statm");
    uint64_t pages[6] = {};
    for (uint64_t& field : pages) file >> field;
    return pages[5] * uint64_t(sysconf(_SC_PAGESIZE));
}

/// In the child. Sends a mesh, or why there is none.
void serve(const End& out, const std::function<Mesh()>& work) {
    std::string cause;
    Mesh mesh;
    try {
        mesh = work();
    } catch (const std::exception& error) {
        cause = std::string(error.what()).substr(0, longest_cause);
        std::replace(cause.begin(), cause.end(), '\n', ' ');
        if (cause.empty()) cause = "unknown";
    }
    const std::vector<char> text(cause.begin(), cause.end());
    if (out.put_all(text) && text.empty()) out.put_all(mesh.positions) && out.put_all(mesh.normals) && out.put_all(mesh.velocities) && out.put_all(mesh.triangles);
}

std::string how_it_ended(pid_t child) {
    int status = 0;
    while (waitpid(child, &status, 0) < 0 && errno == EINTR) {}
    if (WIFSIGNALED(status) && WTERMSIG(status) == SIGXCPU) return too_long;
    return "reading it crashes";
}

}  // namespace

Mesh mesh_in_child(const std::filesystem::path& path, const ChildLimits& limits, const std::function<Mesh()>& work) {
    End out, in;
    pid_t child = -1;
    {
        // One at a time: a child of another thread would keep a copy of this one's end of the pipe open.
        static std::mutex forking;
        const std::lock_guard lock(forking);
        int ends[2];
        if (pipe(ends) == 0) in.file = ends[0], out.file = ends[1], child = fork();
        if (child < 0) throw InputError(path.string() + ": cannot be read in a process of its own: " + std::strerror(errno));
        if (child == 0) {
            in.close();
            limit(RLIMIT_DATA, data_bytes() + limits.memory);
            limit(RLIMIT_CPU, limits.seconds);
            limit(RLIMIT_CORE, 0);
            serve(out, work);
            _exit(0);
        }
        out.close();
    }
    in.deadline = Clock::now() + std::chrono::seconds(limits.wait);
    std::vector<char> cause;
    Mesh mesh;
    const bool answered = in.get_all(cause);
    const bool whole = answered && cause.empty() && in.get_all(mesh.positions) && in.get_all(mesh.normals) && in.get_all(mesh.velocities) && in.get_all(mesh.triangles);
    const bool stuck = !whole && in.late();
    if (stuck) kill(child, SIGKILL);
    in.close();  // a child still writing ends too
    const std::string end = how_it_ended(child);
    if (whole) return mesh;
    const std::string why = answered && !cause.empty() ? std::string(cause.begin(), cause.end()) : stuck ? too_long : end;
    throw InputError(path.string() + ": not usable: " + why);
}

}  // namespace rill::cooker
