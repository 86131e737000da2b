/* Reads matrix, order and contact rows from a file of `condense write`, and measures time and memory of the compared programs. */
#ifndef MATRIX_H
#define MATRIX_H
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/resource.h>
#include <time.h>

typedef struct {
    int64_t n, entries, contact;
    int64_t *offsets, *rows, *order, *contact_rows;
    double *values;
} matrix;

static void *read_block(FILE *file, int64_t count, size_t size) {
    void *block = malloc((size_t)count * size);
    if (!block || fread(block, size, (size_t)count, file) != (size_t)count) {
        fprintf(stderr, "the matrix file is too short\n");
        exit(1);
    }
    return block;
}

static matrix read_matrix(const char *path) {
    matrix m;
    FILE *file = fopen(path, "rb");
    if (!file) {
        perror(path);
        exit(1);
    }
    int64_t *sizes = read_block(file, 3, 8);
    m.n = sizes[0], m.entries = sizes[1], m.contact = sizes[2];
    m.offsets = read_block(file, m.n + 1, 8);
    m.rows = read_block(file, m.entries, 8);
    m.order = read_block(file, m.n, 8);
    m.contact_rows = read_block(file, m.contact, 8);
    m.values = read_block(file, m.entries, 8);
    fclose(file);
    return m;
}

static double seconds(clockid_t clock) {
    struct timespec t;
    clock_gettime(clock, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static double lap_wall, lap_cpu;

static void start(void) {
    lap_wall = seconds(CLOCK_MONOTONIC);
    lap_cpu = seconds(CLOCK_PROCESS_CPUTIME_ID);
}

static void lap(const char *stage) {
    double wall = seconds(CLOCK_MONOTONIC), cpu = seconds(CLOCK_PROCESS_CPUTIME_ID);
    printf("%s_wall %.4f\n%s_cpu %.4f\n", stage, wall - lap_wall, stage, cpu - lap_cpu);
    start();
}

static void print_peak(void) {
    struct rusage usage;
    getrusage(RUSAGE_SELF, &usage);
    printf("peak_bytes %ld\n", usage.ru_maxrss * 1024L);
}
#endif
