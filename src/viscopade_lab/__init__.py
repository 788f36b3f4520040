"""Evidence about viscopade: claims, figures, hard cases, benchmarks. viscopade never imports it."""
