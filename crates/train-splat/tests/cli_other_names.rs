//! Command lines in the words of gsplat, Brush and nerfstudio.
#![expect(clippy::unwrap_used, reason = "a test whose program did not run has failed")]

use std::process::Command;

use serde_json::Value;

fn config(words: &str) -> Value {
    let output = Command::new(env!("CARGO_BIN_EXE_train-splat"))
        .args(["--capture=capture.json", "-o=g.ply", "--dump-config"])
        .args(words.split(' '))
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{words}: {text}");
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn flags_of_other_programs_mean_ours() {
    for (theirs, ours) in [
        ("--max_steps 70 --strategy mcmc", "--iterations 70 --densify relocate"),
        ("--total-train-iters=70 --max-splats 900", "--iterations 70 --max-gaussians 900"),
        ("--random_bkgd --ssim_lambda 0.1", "--background random --ssim-weight 0.1"),
        ("--init_type random --init_num_pts 50", "--start random --init-random 50"),
        ("--background-color white --strategy default", "--background white --densify pull"),
        ("--init-type sfm --cap_max 800", "--start points --max-gaussians 800"),
        ("--ckpt a.safetensors", "--resume a.safetensors"),
    ] {
        assert_eq!(config(theirs), config(ours), "{theirs}");
    }
}
