//! See [`omnibus`].

fn main() -> std::process::ExitCode {
    omnibus::main()
}
