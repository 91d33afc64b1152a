// SPDX-License-Identifier: MIT
// The encoding half of runtime/format/entropy_decoder.h.
#pragma once
#include <cmath>
#include <cstdint>
#include <vector>

#include "format/chunk_model.h"

namespace rill::cooker {

class RangeEncoder {
public:
    /// Appends to `bytes`. `spent` counts bits by category (format::BitCategory).
    RangeEncoder(std::vector<uint8_t>& bytes, double (&spent)[format::bit_categories]) : bytes_(bytes), spent_(spent) {}

    uint32_t bit(uint32_t probability, uint32_t value) {
        const uint32_t bound = uint32_t((uint64_t(range_) * probability) >> 16);
        spent_[category_] -= std::log2((value ? probability : 65536 - probability) / 65536.0);
        if (value) {
            range_ = bound;
        } else {
            low_ += bound;
            range_ -= bound;
        }
        while (range_ < (1u << 24)) {
            shift();
            range_ <<= 8;
        }
        return value ? 1 : 0;
    }
    /// One byte is enough: some value within the range ends in three zero bytes, which the decoder supplies.
    void finish() {
        low_ = (low_ + 0xffffffu) & ~uint64_t(0xffffffu);
        shift();
    }
    bool exhausted() const { return false; }
    void category(int which) { category_ = which; }

private:
    void shift() {
        if (low_ >> 32)  // carry
            for (size_t i = bytes_.size(); i-- > 0 && ++bytes_[i] == 0;) {}
        bytes_.push_back(uint8_t(low_ >> 24));
        low_ = (low_ & 0xffffffu) << 8;
    }
    std::vector<uint8_t>& bytes_;
    double (&spent_)[format::bit_categories];
    uint64_t low_ = 0;
    uint32_t range_ = 0xffffffffu;
    int category_ = 0;
};

}  // namespace rill::cooker
