/* Features of a turn, in the angle domain. Reference: tirelib.measured.features.extract. */
#ifndef TIRE_FEATURES_H
#define TIRE_FEATURES_H

#include "turns.h"

/* Features of the reference that are no copy of the turn's; same names and units, over gages. */
typedef struct {
    double lead[GAGES], trail[GAGES], rate_lead[GAGES], rate_trail[GAGES];
    double cp1[GAGES], cp2[GAGES], tp[GAGES];
    double cp1_angle[GAGES], cp2_angle[GAGES], tp_angle[GAGES];
    double e_vertical[GAGES], e_friction[GAGES], skew[GAGES];
    int gage_flags[GAGES];
    int flags;
} Features;

/* Read the features of a turn. Reference: extract_features; test: test_native_turns. */
void extract_features(const Turn *turn, int gages, Features *features);

#endif
