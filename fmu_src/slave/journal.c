/* What an instance tells its importer: an error when it is new, and at its 10th, 100th .. time.
 * Reference: tirelib.fmu.journal */
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "slave.h"

void slave_tell(const Slave *s, const char *text) { s->dialect->tell(s->host, s->name, text, 0); }

/* Write what stands for a placeholder of a text; returns its length, 0 if there is none. */
static size_t filled(const char *text, const char *const word[4], const char *const value[4],
                     const char **found) {
    for (int i = 0; i < 4; i++)
        if (!strncmp(text, word[i], strlen(word[i]))) {
            *found = value[i];
            return strlen(word[i]);
        }
    return 0;
}

/* Reference: Remark.text */
void slave_remark(Slave *s, int kind, const Remark *r, const char *name) {
    static const char *const WORD[4] = {"{name}", "{value}", "{low}", "{high}"};
    char line[LINE], number[3][32];
    const double given[3] = {r->value, r->low, r->high};
    const char *value[4] = {name, number[0], number[1], number[2]};
    size_t n = 0;
    if (s->remarked & (1u << kind)) return;
    s->remarked |= 1u << kind;
    for (int i = 0; i < 3; i++) /* the sign of a NaN says nothing */
        snprintf(number[i], sizeof number[i], "%g", isnan(given[i]) ? fabs(given[i]) : given[i]);
    for (const char *c = s->own.remark[kind], *found = c; *c && n < LINE - 1;) {
        size_t taken = filled(c, WORD, value, &found);
        if (taken)
            n += (size_t)snprintf(line + n, LINE - n, "%s", found);
        else
            line[n++] = *c;
        c += taken ? taken : 1;
    }
    line[n < LINE ? n : LINE - 1] = 0;
    s->dialect->tell(s->host, s->name, line, 1);
}

static int power_of_ten(unsigned n) {
    while (n % 10 == 0) n /= 10;
    return n == 1;
}

void slave_complain(Slave *s, const char *cause) {
    uint64_t h = 14695981039346656037u;
    unsigned i = 0;
    char line[LINE + 64];
    for (const char *c = cause; *c; c++) h = (h ^ (unsigned char)*c) * 1099511628211u;
    while (i < s->causes && i < CAUSES && s->told[i] != h) i++;
    if (i == CAUSES) {
        if (s->causes++ == CAUSES)
            slave_tell(s,
                       "50 different causes were reported; further causes are not reported until a "
                       "reset");
        if (s->causes > CAUSES + 1) s->causes = CAUSES + 1;
        return;
    }
    if (i == s->causes) {
        s->told[i] = h;
        s->times[i] = 1;
        s->causes++;
        slave_tell(s, cause);
    } else if (power_of_ten(++s->times[i])) {
        snprintf(line, sizeof line, "%s (%u times by now)", cause, s->times[i]);
        slave_tell(s, line);
    }
}

int slave_failed(Slave *s, const char *format, ...) {
    char cause[LINE];
    va_list given;
    va_start(given, format);
    vsnprintf(cause, sizeof cause, format, given);
    va_end(given);
    slave_complain(s, cause);
    return FAILED;
}
