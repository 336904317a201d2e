use super::*;
use crate::ExitStatus;
use crate::error::status_of;

fn context(overwrite: bool) -> Context {
    Context::new("motes demo".into(), CommonArgs { overwrite, ..CommonArgs::default() })
}

#[test]
fn an_existing_output_is_refused_before_work() {
    let dir = tempfile::tempdir().unwrap();
    let taken = dir.path().join("a.ply");
    std::fs::write(&taken, "x").unwrap();
    let error = context(false).output(&taken).unwrap_err();
    assert_eq!(status_of(&error), ExitStatus::Usage);
    assert!(error.to_string().contains("--overwrite"), "{error}");
    assert_eq!(context(true).output(&taken).unwrap(), taken);
}

#[test]
fn an_empty_folder_is_free_and_a_full_one_is_not() {
    let dir = tempfile::tempdir().unwrap();
    let renders = dir.path().join("renders");
    std::fs::create_dir(&renders).unwrap();
    assert!(context(false).output(&renders).is_ok());
    std::fs::write(renders.join("a.png"), "x").unwrap();
    assert!(context(false).output(&renders).is_err());
}

#[test]
fn the_folder_of_an_output_is_made() {
    let dir = tempfile::tempdir().unwrap();
    context(false).output(dir.path().join("a/b/c.ply")).unwrap();
    assert_eq!(std::fs::read_dir(dir.path().join("a/b")).unwrap().count(), 0);
    let file = dir.path().join("plain");
    std::fs::write(&file, "x").unwrap();
    let error = context(false).output(file.join("c.ply")).unwrap_err();
    assert_eq!(status_of(&error), ExitStatus::Failed);
}

#[test]
fn two_outputs_need_two_paths() {
    let dir = tempfile::tempdir().unwrap();
    let context = context(false);
    context.output(dir.path().join("a")).unwrap();
    let error = context.output(dir.path().join("a")).unwrap_err();
    assert_eq!(status_of(&error), ExitStatus::Usage);
}

#[test]
fn stdout_holds_the_report_or_the_product() {
    let common = CommonArgs { json: true, ..CommonArgs::default() };
    let error = Context::new("motes demo".into(), common).output("-").unwrap_err();
    assert_eq!(status_of(&error), ExitStatus::Usage);
    assert_eq!(context(false).output("-").unwrap(), Path::new("-"));
}

#[test]
fn a_missing_input_is_bad_input() {
    let dir = tempfile::tempdir().unwrap();
    let context = context(false);
    let error = context.input("capture", dir.path().join("none")).unwrap_err();
    assert_eq!(status_of(&error), ExitStatus::BadInput);
    std::fs::write(dir.path().join("some"), "abc").unwrap();
    context.input("capture", dir.path().join("some")).unwrap();
    let hash = context.lock().inputs[0].sha256.clone().unwrap();
    assert!(hash.starts_with("ba7816bf") && hash.len() == 64);
}

#[test]
fn what_is_read_is_not_replaced() {
    let dir = tempfile::tempdir().unwrap();
    let (file, folder) = (dir.path().join("a.ply"), dir.path().join("scene"));
    std::fs::write(&file, "x").unwrap();
    std::fs::create_dir(&folder).unwrap();
    std::fs::write(folder.join("gaussians.ply"), "x").unwrap();
    let usage = |result: anyhow::Result<PathBuf>| {
        let error = result.unwrap_err();
        assert!(error.to_string().contains("would be replaced"), "{error}");
    };
    let context = Context::quiet("test");
    context.output(&file).unwrap();
    let again = dir.path().join("scene/../a.ply");
    usage(context.input("gaussians", &again).map(|()| file.clone()));
    let context = Context::quiet("test");
    context.input("gaussians", folder.join("gaussians.ply")).unwrap();
    usage(context.output(folder.join("gaussians.ply")));
    // A folder of pictures may hold the file that they are drawn from; a scene folder would replace it.
    context.output(&folder).unwrap();
    assert!(context.output_files(&folder, &["surface.ply"]).is_ok());
    assert!(context.output_files(&folder, &["gaussians.ply"]).is_err());
    context.input("null", "/dev/null").unwrap();
    context.output("/dev/null").unwrap();
}
