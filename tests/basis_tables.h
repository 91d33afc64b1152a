// SPDX-License-Identifier: MIT
// The time basis of windows as long as the format has them.
#pragma once
#include <vector>

#include "format/fourier_extension.h"
#include "format/layout.h"

inline const rill::format::BasisTables& tables() {
    using namespace rill::format;
    static std::vector<double> memory(basis_tables_bytes(max_window_samples) / sizeof(double));
    static const BasisTables built = [] {
        BasisTables tables;
        build_basis_tables(tables, memory.data(), max_window_samples);
        return tables;
    }();
    return built;
}
