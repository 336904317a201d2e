//! Pure numerics: no files, no scene types, no thread-pool policy, no hidden randomness.
