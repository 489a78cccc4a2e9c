#include "resources.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifdef _WIN32
#include <windows.h>
#endif

static const char FORMAT[] = "tirelib-core/1";

static const char MISSING[] = "cannot be read";

static int digit(char c) {
    if (c >= '0' && c <= '9') return c - '0';
    c = (char)(c | 32);
    return c >= 'a' && c <= 'f' ? c - 'a' + 10 : -1;
}

void path_of(const char *uri, char *path) {
    char *begin = path;
    int coded = !strncmp(uri, "file:", 5);
    if (coded) {
        uri += 5;
        if (!strncmp(uri, "//", 2)) uri += 2 + strcspn(uri + 2, "/"); /* a host */
    }
    for (; *uri; uri++) {
        if (coded && *uri == '%' && digit(uri[1]) >= 0 && digit(uri[2]) >= 0) {
            *path++ = (char)(16 * digit(uri[1]) + digit(uri[2]));
            uri += 2;
        } else {
            *path++ = *uri;
        }
    }
    *path = 0;
    if (begin[0] == '/' && begin[1] && begin[2] == ':') memmove(begin, begin + 1, strlen(begin));
}

/* Open a file whose path is UTF-8. */
static FILE *opened(const char *path) {
#ifdef _WIN32
    int n = MultiByteToWideChar(CP_UTF8, 0, path, -1, NULL, 0);
    wchar_t *wide = n > 0 ? malloc((size_t)n * sizeof *wide) : NULL;
    FILE *file = NULL;
    if (wide && MultiByteToWideChar(CP_UTF8, 0, path, -1, wide, n)) file = _wfopen(wide, L"rb");
    free(wide);
    return file;
#else
    return fopen(path, "rb");
#endif
}

/* Read all bytes of a file, and a zero after them. */
static char *bytes_of(const char *path, size_t *n) {
    FILE *file = opened(path);
    char *bytes = NULL;
    long size = -1;
    if (!file) return NULL;
    if (!fseek(file, 0, SEEK_END)) size = ftell(file);
    if (size >= 0 && !fseek(file, 0, SEEK_SET)) bytes = malloc((size_t)size + 1);
    if (bytes && fread(bytes, 1, (size_t)size, file) != (size_t)size) {
        free(bytes);
        bytes = NULL;
    }
    fclose(file);
    if (!bytes) return NULL;
    *n = (size_t)size;
    bytes[size] = 0;
    return bytes;
}

/* End the line that begins at *at and go behind it; NULL if there is none. */
static const char *line(char **at, const char *end) {
    char *begin = *at, *stop = begin;
    while (stop < end && *stop != '\n') stop++;
    if (stop == end) return NULL;
    *stop = 0;
    *at = stop + 1;
    return begin;
}

/* Whether what follows the first line has the hash that stands in it, if one does. */
static int undamaged(const char *hash, const char *rest, size_t n) {
    char sum[18];
    snprintf(sum, sizeof sum, " %016" PRIx64, state_hash(rest, n));
    return !*hash || !strcmp(hash, sum);
}

/* Take the lines behind the first; returns whether they are complete. */
static int lines_read(Resources *r, char **at, const char *end) {
    const char *count;
    char *behind;
    r->guid = line(at, end);
    r->tire = line(at, end);
    count = line(at, end);
    if (!r->guid || !r->tire || !count) return 0;
    r->variables = strtoul(count, &behind, 10);
    r->remarks = strtoul(behind, NULL, 10);
    size_t most = (size_t)(end - *at);
    if (r->variables > most || r->remarks > most) return 0;
    r->variable = calloc(r->variables + r->remarks + 1, sizeof *r->variable);
    if (!r->variable) return 0;
    r->remark = r->variable + r->variables;
    for (size_t i = 0; i < r->variables + r->remarks; i++) {
        r->variable[i] = line(at, end);
        if (!r->variable[i] || (i < r->variables && strlen(r->variable[i]) < 3)) return 0;
    }
    return 1;
}

const char *resources_read(Resources *r, const char *path) {
    size_t n = 0;
    double head[4];
    memset(r, 0, sizeof *r);
    r->memory = bytes_of(path, &n);
    if (!r->memory) return MISSING;
    char *at = r->memory, *end = r->memory + n;
    const char *format = line(&at, end);
    size_t length = sizeof FORMAT - 1;
    if (!format || strncmp(format, FORMAT, length)) return "is no tirelib-core/1";
    int whole = undamaged(format + length, at, (size_t)(end - at));
    if (!lines_read(r, &at, end)) return "is no tirelib-core/1";
    if ((size_t)(end - at) < sizeof head || (size_t)(end - at) % sizeof(double))
        return "is cut off";
    if (!whole) return "is damaged";
    memcpy(head, at, sizeof head);
    at += sizeof head;
    r->samples = head[0];
    r->buffered = head[1];
    r->rate = head[2];
    r->missing = head[3];
    r->numbers = (size_t)(end - at) / sizeof(double);
    r->table = malloc((size_t)(end - at) + 1);
    if (!r->table) return "needs more memory than there is";
    memcpy(r->table, at, (size_t)(end - at));
    return NULL;
}

int resources_missing(const char *wrong) { return wrong == MISSING; }

void resources_free(Resources *r) {
    free(r->memory);
    free((void *)r->variable);
    free(r->table);
    memset(r, 0, sizeof *r);
}
