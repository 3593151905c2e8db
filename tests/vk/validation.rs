//! The checks check: what the tests of `vk` rely on is shown to fail on sabotaged input.

use nephroid::Error;
use nephroid::low_level::vk::*;

use crate::support::affine::*;
use crate::support::device::{alone, open as device, validated as options};

/// Two dependent kernels; without a barrier between them if `sabotaged`.
fn chain(device: &std::sync::Arc<Device>, sabotaged: bool) {
    let source = upload(device, &[1; 64]);
    let middle = device.buffer("middle", 256, Place::Device).unwrap();
    let target = device.buffer("target", 256, Place::Readback).unwrap();
    let kernel = affine(device, 2);
    let mut recorder = device.recorder("chain").unwrap();
    recorder.begin_scope("first");
    let first = [(0, BufferSlice::whole(&source)), (1, BufferSlice::whole(&middle))];
    recorder.bind(&kernel, &first, &push(64, 0)).unwrap();
    recorder.dispatch([1, 1, 1]);
    recorder.end_scope();
    if !sabotaged {
        recorder.barrier();
    }
    recorder.begin_scope("second");
    let second = [(0, BufferSlice::whole(&middle)), (1, BufferSlice::whole(&target))];
    recorder.bind(&kernel, &second, &push(64, 0)).unwrap();
    recorder.dispatch([1, 1, 1]);
    recorder.end_scope();
    recorder.finish().unwrap().submit().unwrap().wait().unwrap();
}

#[test]
fn a_missing_barrier_is_caught() {
    let _alone = alone();
    let device = device();
    chain(&device, false);
    device.check_validation().unwrap();
    chain(&device, true);
    let messages = device.validation_messages();
    assert!(messages.iter().any(|message| message.contains("SYNC-HAZARD-READ-AFTER-WRITE")), "{messages:?}");
    assert!(matches!(device.check_validation(), Err(Error::Validation(list)) if list == messages));
}

#[test]
fn a_copy_that_overtakes_a_kernel_is_caught() {
    let _alone = alone();
    let device = device();
    let source = upload(&device, &[1; 64]);
    let target = device.buffer("target", 256, Place::Readback).unwrap();
    let mut recorder = device.recorder("overtake").unwrap();
    let bindings = [(0, BufferSlice::whole(&source)), (1, BufferSlice::whole(&target))];
    recorder.bind(&affine(&device, 1), &bindings, &push(64, 0)).unwrap();
    recorder.dispatch([1, 1, 1]);
    recorder.copy(&target, 0, &source, 0, 256);
    let _ = recorder.finish().unwrap();
    assert!(!device.validation_messages().is_empty());
}

#[test]
fn a_kernel_that_needs_more_than_it_declares_is_caught() {
    let _alone = alone();
    let device = device();
    let desc = PipelineDesc { name: "undeclared", spirv: &AFFINE, bindings: &[0], push_bytes: 8, constants: &[] };
    let _ = device.pipeline(&desc);
    assert!(!device.validation_messages().is_empty(), "binding 1 is used by the kernel");
}

#[test]
#[should_panic(expected = "leave 'small'")]
fn writing_past_the_end_panics() {
    let small = device().buffer("small", 10, Place::Upload).unwrap();
    small.write(8, &[0; 3]);
}

#[test]
#[should_panic(expected = "host cannot see")]
fn reading_device_memory_panics() {
    let hidden = device().buffer("hidden", 10, Place::Device).unwrap();
    hidden.read(0, &mut [0; 4]);
}

#[test]
#[should_panic(expected = "is not aligned")]
fn misaligned_slices_panic() {
    let _alone = alone();
    let device = device();
    let buffer = device.buffer("buffer", 1024, Place::Device).unwrap();
    let slice = BufferSlice { buffer: &buffer, offset: 1, bytes: 4 };
    let _ = device.recorder("misaligned").unwrap().bind(&affine(&device, 1), &[(0, slice), (1, slice)], &push(0, 0));
}

#[test]
#[should_panic(expected = "needs binding 1")]
fn a_forgotten_binding_panics() {
    let _alone = alone();
    let device = device();
    let buffer = device.buffer("buffer", 1024, Place::Device).unwrap();
    let slice = BufferSlice::whole(&buffer);
    let _ = device.recorder("forgotten").unwrap().bind(&affine(&device, 1), &[(0, slice), (0, slice)], &push(0, 0));
}

#[test]
#[should_panic(expected = "workgroups")]
fn too_many_groups_panic() {
    let _alone = alone();
    let device = device();
    let buffer = device.buffer("buffer", 1024, Place::Device).unwrap();
    let slice = BufferSlice::whole(&buffer);
    let mut recorder = device.recorder("many").unwrap();
    recorder.bind(&affine(&device, 1), &[(0, slice), (1, slice)], &push(0, 0)).unwrap();
    recorder.dispatch([1, u32::MAX, 1]);
}

#[test]
fn a_damaged_cache_file_is_ignored_and_replaced() {
    let _alone = alone();
    let folder = tempfile::tempdir().unwrap();
    let options = DeviceOptions { cache: Some(folder.path().to_owned()), ..options() };
    let run = || {
        let device = Device::open(&options).unwrap();
        let log = device.validation_log();
        chain(&device, false);
        drop(device);
        log.check().unwrap();
        let files: Vec<_> = std::fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().path()).collect();
        assert_eq!(files.len(), 1, "{files:?}");
        files[0].clone()
    };
    let file = run();
    let sound = std::fs::read(&file).unwrap();
    assert!(sound.len() > 32);
    for damaged in [Vec::new(), sound[..sound.len() - 1].to_vec(), vec![0xff; 1000]] {
        std::fs::write(&file, &damaged).unwrap();
        assert_eq!(run(), file);
        assert_eq!(std::fs::read(&file).unwrap(), sound, "the damaged file was not replaced");
    }
    // A cache folder that cannot be made is no reason to fail.
    let blocked = DeviceOptions { cache: Some(file.join("below a file")), ..options.clone() };
    chain(&Device::open(&blocked).unwrap(), false);
}
