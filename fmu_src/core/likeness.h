/* Whether the strain is that of the calibrated tire. Reference: tirelib.estimators.likeness. */
#ifndef TIRE_LIKENESS_H
#define TIRE_LIKENESS_H

#include "calibration.h"

/* What `Likeness.apart` of the reference is given beside the regressors. */
typedef struct {
    const double *values;
    const Laws *laws, *force_laws;
    double tread, tread_std, sliding, camber; /* sliding: NaN where the reference gives None */
    const double *moves[2];                   /* of `names` numbers */
} Look;

/* Reference: Likeness.rest; `rest` has a number for each name. */
void likeness_rest(const Likeness *likeness, const double *values, double *rest);

/* Reference: Likeness.apart */
double likeness_apart(const Likeness *likeness, const Constants *k, const Look *look);

/* Reference: Likeness.slope_left */
double slope_left(const Likeness *likeness, const Constants *k, const double *values,
                  double sliding, double *noise);

#endif
