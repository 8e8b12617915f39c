// Nothing: this target exists for its precompiled headers.
int main() {}
