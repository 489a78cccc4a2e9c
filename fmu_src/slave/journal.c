/* What an instance tells its importer: an error when it is new, and at its 10th, 100th .. time.
 * Reference: tirelib.fmu.journal */
#include <stdarg.h>
#include <stdio.h>

#include "slave.h"

void slave_tell(const Slave *s, const char *text) { s->dialect->tell(s->host, s->name, text); }

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
