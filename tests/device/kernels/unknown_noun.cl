// Takes a noun that nouns.h does not have (cmake/embed.cmake).
kernel void unknown_noun(SAMPLES_OF(const, sample), const int n) {}
