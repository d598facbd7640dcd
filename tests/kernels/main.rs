//! Kernels against exact arithmetic: every shape on random rays and on the awkward ones.

mod basics;
mod dd;
mod exact;
mod lanes;
mod leaving;
mod mesh;
mod oracle;
mod polynomial;
mod scale;
mod support;
