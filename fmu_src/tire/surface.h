/* The response surface of a virtual tire: strain over the wheel angle as a smooth function of the
 * condition. Reference: tirelib.fmu.virtual.surface, coordinates, waveform. The data are a table,
 * written by tirelib.fmu.virtual.core_table. Test: test_native_virtual */
#ifndef TIRE_SURFACE_H
#define TIRE_SURFACE_H

#include <stddef.h>

enum { MOST_INPUTS = 7, MOST_PLACES = 9, MOST_ANSWERS = 128, MOST_BASIS = 4096, TIRE_GAGES = 16 };
enum { IN_LOAD, IN_ALPHA, IN_KAPPA, IN_CAMBER, IN_SPEED, IN_PRESSURE, IN_FRICTION };
enum { OUT_FORCES = 4, ROLLING_TERMS = 20 };

typedef struct {
    int gages, inputs, parts, grid, points, terms, places, answers;
    const double *low, *high;    /* range of the inputs */
    const double *slip;          /* 4: how slip acts */
    const double *scales;        /* of the places */
    const double *shift, *scale; /* of the places in the polynomial */
    const double *powers;        /* terms x places */
    const double *at;            /* points x places */
    const double *weights;       /* (points + terms) x answers */
    const double *spline;        /* grid x gages x (parts + 1), the mean last */
    const double *rolling;       /* of the rolling radius */
} TireSurface;

/* Find the parts of a table; returns whether it is one. The table stays the caller's. */
int tire_surface_read(TireSurface *s, const double *table, size_t n);

/* Which inputs are out of range or no numbers: bits by input. */
int tire_outside(const TireSurface *s, const double *inputs);

/* Scores of the components, squared half angle and middle of the contact of every gage, forces. */
void tire_answers(const TireSurface *s, const double *inputs, double *answers);

/* Strain of every gage at a wheel angle. */
void tire_strain(const TireSurface *s, const double *answers, double angle, double *strain);

double tire_rolling_radius(const TireSurface *s, double load, double speed, double pressure);

#endif
