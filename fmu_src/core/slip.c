#include "slip.h"

static const double PULL_SLIP = 0.0066;

double unseen_by_load(double here, double before) {
    return 0.5 / sqrt(3.0) * fabs(here * here - (isnan(before) ? 0.0 : before * before));
}

double unseen_by_traction(const Rolled *here, const Rolled *before, double half) {
    double changed = here->ratio / before->ratio - 1.0;
    double pulled = PULL_SLIP / (half * sqrt(half)) * (here->pull - before->pull);
    double unseen = fabs(changed + pulled);
    return isfinite(unseen) ? unseen : 0.0;
}

double pull_of(const double *strain) {
    double before = INFINITY, behind = INFINITY, highest = -INFINITY;
    for (int k = 0; k < ANGLES; k++) {
        if (!isfinite(strain[k])) continue;
        if (phi_at(k) < 0.0)
            before = fmin(before, strain[k]);
        else
            behind = fmin(behind, strain[k]);
        highest = fmax(highest, strain[k]);
    }
    return highest > 0.0 ? (before - behind) / highest : NAN;
}
