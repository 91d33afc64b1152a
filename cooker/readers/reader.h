// SPDX-License-Identifier: MIT
// One interface for every input format. A reader hands out frames in metres and metres per second,
// in the source's own frame numbers and time, wound counter-clockwise seen from the air.
#pragma once
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/mesh.h"

namespace rill::cooker {

enum class VelocityMeaning {
    none,      ///< the source has none
    forward,   ///< carries frame k on to k + 1 (Mantaflow)
    backward,  ///< brought the liquid to frame k (FLIP Fluids)
    unknown,   ///< to be found out by advecting against both neighbours
};
struct SequenceInfo {
    std::string format;            ///< "Mantaflow cache", "PLY sequence" …
    std::string path;              ///< as given
    std::vector<int> numbers;      ///< the source's frame numbers, ascending, evenly stepped
    std::vector<double> seconds;   ///< time of each on the source's clock
    double frames_per_second = 24;
    VelocityMeaning velocity = VelocityMeaning::none;
    bool velocity_estimated = false;  ///< from the surfaces: it tells nothing of how the liquid slides along them
    uint64_t raw_bytes = 0;        ///< size of the source files read
};
struct ReadOptions {
    double frames_per_second = 0;  ///< 0: what the source says, else 24
    int first = 0, last = 0, step = 0;  ///< --frames A:B:S; step 0: all frames
    std::string velocity_name;     ///< attribute; empty: names users know (see README); "estimate": from the surfaces
    bool velocity_per_frame = false;
    char up = 0;                   ///< 'y' or 'z': the source's axis that points up; 0: z. Assets are z up
    char handedness = 0;           ///< 'l' or 'r'; 0: right. A left-handed source is mirrored in the horizontal axis that is not x
    double scale = 0;              ///< metres per unit of the source; 0: 1
    bool require_velocity = false; ///< a source without velocity gets an estimate, and `warn` is told
    /// Told in one line what was put right or guessed; may be called from several threads, one at a time.
    std::function<void(const std::string&)> warn;
};

class SequenceReader {
public:
    virtual ~SequenceReader() = default;
    virtual const SequenceInfo& info() const = 0;
    /// Frame `index` of info().numbers, checked: finite, indices in range; no triangles is legal.
    /// Thread safe. Throws InputError naming file and cause.
    virtual Mesh read(size_t index) const = 0;
    /// The same for those who need no velocity: it may be left out where it costs time (estimated velocity).
    virtual Mesh read_surface(size_t index) const { return read(index); }
    /// What messages call frame `index`: its file.
    virtual std::string name(size_t index) const = 0;
    /// All files that frame `index` depends on, shared ones too; some may stand in many frames' lists.
    virtual std::vector<std::filesystem::path> files(size_t index) const = 0;
};

/// Looks at the path and picks the reader: frames as they come, where frames/open_sequence.h checks them. Throws InputError.
std::unique_ptr<SequenceReader> open_reader(const std::string& input, const ReadOptions& options);

}  // namespace rill::cooker
