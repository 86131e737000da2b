/* Library that tests/reliability/faults.rs preloads into the program. It makes a chosen file operation fail, or kills the program
 * at this operation.
 *
 * FAULT_UNDER  Folder. Only operations on files below this folder are counted.
 * FAULT_AT     Number of the chosen operation, from 1. If it is 0, no operation fails.
 * FAULT_MODE   once: the operation fails. ever: the operation and all later operations fail. kill: the program is killed before the
 *              operation. half: a write operation writes half of its bytes, and then fails.
 * FAULT_COUNT  File to which the number of operations is written when the program ends.
 *
 * fsync is counted, but does not flush. The tests only kill processes, and files of a killed process need no flush.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <signal.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/types.h>
#include <unistd.h>

static atomic_long operations;
static const char *under, *mode, *count;
static long at;

__attribute__((constructor)) static void begin(void)
{
    under = getenv("FAULT_UNDER");
    mode = getenv("FAULT_MODE");
    count = getenv("FAULT_COUNT");
    at = getenv("FAULT_AT") ? atol(getenv("FAULT_AT")) : 0;
}

__attribute__((destructor)) static void end(void)
{
    FILE *file = count ? fopen(count, "w") : NULL;
    if (file) {
        fprintf(file, "%ld", (long)operations);
        fclose(file);
    }
}

static int concerns(const char *path)
{
    return under && path && strncmp(path, under, strlen(under)) == 0;
}

static int concerns_open(int fd)
{
    char link[64], path[PATH_MAX];
    snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
    ssize_t n = readlink(link, path, sizeof path - 1);
    if (n < 0)
        return 0;
    path[n] = 0;
    return concerns(path);
}

/* Counts an operation. Returns whether the operation must fail. */
static int fails(void)
{
    long number = atomic_fetch_add(&operations, 1) + 1;
    if (at == 0 || number < at || (number > at && strcmp(mode, "ever") != 0))
        return 0;
    if (strcmp(mode, "kill") == 0)
        raise(SIGKILL);
    errno = ENOSPC;
    return 1;
}

#define REAL(name) ((__typeof__(&name))dlsym(RTLD_NEXT, #name))

ssize_t write(int fd, const void *bytes, size_t n)
{
    if (concerns_open(fd) && fails()) {
        if (strcmp(mode, "half") == 0 && n > 1)
            REAL(write)(fd, bytes, n / 2);
        errno = ENOSPC;
        return -1;
    }
    return REAL(write)(fd, bytes, n);
}

int fsync(int fd)
{
    return concerns_open(fd) && fails() ? -1 : 0;
}

int fdatasync(int fd)
{
    return fsync(fd);
}

int rename(const char *from, const char *to)
{
    return concerns(to) && fails() ? -1 : REAL(rename)(from, to);
}

int unlink(const char *path)
{
    return concerns(path) && fails() ? -1 : REAL(unlink)(path);
}

int mkdir(const char *path, mode_t permissions)
{
    return concerns(path) && fails() ? -1 : REAL(mkdir)(path, permissions);
}

static int open_with(const char *name, const char *path, int flags, mode_t permissions)
{
    int (*real)(const char *, int, ...) = dlsym(RTLD_NEXT, name);
    if ((flags & (O_CREAT | O_WRONLY | O_RDWR)) && concerns(path) && fails())
        return -1;
    return real(path, flags, permissions);
}

#define OPEN(name)                                   \
    int name(const char *path, int flags, ...)       \
    {                                                \
        va_list list;                                \
        va_start(list, flags);                       \
        mode_t permissions = va_arg(list, mode_t);   \
        va_end(list);                                \
        return open_with(#name, path, flags, permissions); \
    }
OPEN(open)
OPEN(open64)
