// Fills messages with the table of faults, for reports of the daemon and for sonarctl if no daemon runs.
#pragma once

#include "protocol/fault_kinds.hpp"

namespace sonar::v1 {
class FaultKind;
class Trouble;
}  // namespace sonar::v1

namespace sonar {

/// Fills all fields except `without_effect`.
void fill(v1::FaultKind& out, const FaultKind& kind);
/// Fills the name, the sentence and the codes.
void fill(v1::Trouble& out, const Trouble& trouble);

}  // namespace sonar
