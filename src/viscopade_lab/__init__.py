"""Evidence about viscopade: claims, figures, hard cases, benchmarks, reports. viscopade never imports it."""
