//! The device layer on whatever Vulkan device there is, under validation with synchronisation validation.

use nephroid::low_level::vk::*;
use nephroid::{Error, MemoryCause};

use crate::support::affine::*;
use crate::support::device::{alone, open as device, validated as options};

fn numbers(count: u32) -> Vec<u32> {
    (0..count).map(|i| i.wrapping_mul(2_654_435_761)).collect()
}

#[test]
fn devices_are_listed_with_what_they_can_do() {
    let _alone = alone();
    let list = devices().unwrap();
    assert!(!list.is_empty());
    for (index, info) in list.iter().enumerate() {
        assert_eq!(info.index, index);
        assert!(!info.name.is_empty() && !info.driver.is_empty());
        for &feature in Feature::ALL {
            let lacked = info.lacks.iter().any(|text| text == feature.describe());
            assert_eq!(lacked, !info.features.has(feature), "{feature:?} of {}", info.name);
        }
    }
}

#[test]
fn features_are_required_by_name() {
    let _alone = alone();
    let device = device();
    device.require(&[Feature::Timeline, Feature::ScalarLayout]).unwrap();
    let features = device.info().features;
    let missing: Vec<Feature> = Feature::ALL.iter().copied().filter(|&feature| !features.has(feature)).collect();
    let wanted = device.require(Feature::ALL);
    match missing.first() {
        None => wanted.unwrap(),
        Some(first) => {
            assert!(matches!(wanted, Err(Error::MissingFeature { feature, .. }) if feature.contains(first.describe())))
        }
    }
}

#[test]
fn bytes_survive_the_way_through_device_memory() {
    let _alone = alone();
    let device = device();
    let data = numbers(1000);
    let source = upload(&device, &data);
    let middle = device.buffer("middle", 4000, Place::Device).unwrap();
    let target = device.buffer("target", 4004, Place::Readback).unwrap();
    target.write(0, &[0xab; 4004]);
    let mut recorder = device.recorder("copy").unwrap();
    recorder.copy(&source, 0, &middle, 0, 4000);
    recorder.barrier();
    recorder.fill(&middle, 8, 4, 7);
    recorder.barrier();
    recorder.copy(&middle, 0, &target, 0, 4000);
    recorder.copy(&middle, 0, &target, 0, 0);
    recorder.finish().unwrap().submit().unwrap().wait().unwrap();
    let mut expected = data;
    expected[2] = 7;
    expected.push(0xabab_abab);
    assert_eq!(words(&target), expected);
    device.check_validation().unwrap();
}

#[test]
fn a_kernel_runs_on_slices_with_constants_and_push_constants() {
    let _alone = alone();
    let device = device();
    let align = device.info().limits.storage_alignment.max(4);
    let data = numbers(300);
    let source = upload(&device, &data);
    let target = device.buffer("target", align + 1200, Place::Readback).unwrap();
    target.write(0, &vec![0xcd; (align + 1200) as usize]);
    let slice = BufferSlice { buffer: &target, offset: align, bytes: 1200 };
    let mut recorder = device.recorder("affine").unwrap();
    recorder.bind(&affine(&device, 3), &[(1, slice), (0, BufferSlice::whole(&source))], &push(299, 5)).unwrap();
    recorder.dispatch([5, 1, 1]);
    recorder.finish().unwrap().submit().unwrap().wait().unwrap();
    let mut expected = vec![0xcdcd_cdcd; (align / 4) as usize];
    expected.extend(data[..299].iter().map(|x| x.wrapping_mul(3).wrapping_add(5)));
    expected.push(0xcdcd_cdcd);
    assert_eq!(words(&target), expected);
    device.check_validation().unwrap();
}

#[test]
fn indirect_dispatch_uses_counts_that_a_kernel_wrote() {
    let _alone = alone();
    let device = device();
    // The kernel makes (2, 1, 1) out of (1, 0, 0): factor 1 and, through the source, the rest.
    let seed = upload(&device, &[1, 0, 0]);
    let arguments = device.buffer("arguments", 12, Place::Device).unwrap();
    let data = numbers(192);
    let source = upload(&device, &data);
    let target = device.buffer("target", 768, Place::Readback).unwrap();
    let kernel = affine(&device, 1);
    let mut recorder = device.recorder("indirect").unwrap();
    recorder.fill(&target, 0, 768, 0);
    let bindings = [(0, BufferSlice::whole(&seed)), (1, BufferSlice::whole(&arguments))];
    recorder.bind(&kernel, &bindings, &push(3, 1)).unwrap();
    recorder.dispatch([1, 1, 1]);
    recorder.barrier();
    let bindings = [(0, BufferSlice::whole(&source)), (1, BufferSlice::whole(&target))];
    recorder.bind(&kernel, &bindings, &push(192, 0)).unwrap();
    recorder.dispatch_indirect(&arguments, 0);
    recorder.finish().unwrap().submit().unwrap().wait().unwrap();
    let expected: Vec<u32> = data.iter().enumerate().map(|(i, &x)| if i < 128 { x } else { 0 }).collect();
    assert_eq!(words(&target), expected, "two groups of 64 invocations were asked for");
    device.check_validation().unwrap();
}

#[test]
fn commands_are_replayed_in_order_and_keep_what_they_use() {
    let _alone = alone();
    let device = device();
    let first = device.buffer("first", 256, Place::Readback).unwrap();
    first.write(0, &[0; 256]);
    let commands = {
        // Only the commands hold on to this one.
        let second = device.buffer("second", 256, Place::Device).unwrap();
        let kernel = affine(&device, 1);
        let mut recorder = device.recorder("increment").unwrap();
        let there = [(0, BufferSlice::whole(&first)), (1, BufferSlice::whole(&second))];
        recorder.bind(&kernel, &there, &push(64, 1)).unwrap();
        recorder.dispatch([1, 1, 1]);
        recorder.barrier();
        recorder.copy(&second, 0, &first, 0, 256);
        recorder.finish().unwrap()
    };
    let runs: Vec<Submission> = (0..100).map(|_| commands.submit().unwrap()).collect();
    runs[99].wait().unwrap();
    assert!(runs.iter().all(|run| run.is_done().unwrap()));
    assert_eq!(words(&first), vec![100; 64]);
    drop(commands.submit().unwrap());
    drop(commands);
    device.wait_idle().unwrap();
    assert_eq!(words(&first), vec![101; 64], "a run whose values are dropped still ends");
    device.check_validation().unwrap();
}

#[test]
fn many_binds_need_more_than_one_descriptor_pool() {
    let _alone = alone();
    let device = device();
    let source = upload(&device, &numbers(64));
    let target = device.buffer("target", 256, Place::Readback).unwrap();
    let bindings = [(0, BufferSlice::whole(&source)), (1, BufferSlice::whole(&target))];
    let mut recorder = device.recorder("many").unwrap();
    for addend in 0..200 {
        recorder.bind(&affine(&device, 1), &bindings, &push(64, addend)).unwrap();
        recorder.dispatch([1, 1, 1]);
        recorder.barrier();
    }
    recorder.finish().unwrap().submit().unwrap().wait().unwrap();
    assert_eq!(words(&target)[1], 2_654_435_761 + 199);
    device.check_validation().unwrap();
}

#[test]
fn pipelines_are_shared_and_told_apart_by_constants() {
    let _alone = alone();
    let device = device();
    let one = affine(&device, 1);
    assert!(std::sync::Arc::ptr_eq(&one, &affine(&device, 1)));
    assert!(!std::sync::Arc::ptr_eq(&one, &affine(&device, 2)));
}

#[test]
fn empty_buffers_and_empty_slices_can_be_bound() {
    let _alone = alone();
    let device = device();
    let empty = device.buffer("empty", 0, Place::Device).unwrap();
    let align = device.info().limits.storage_alignment.max(4);
    let arena = device.buffer("arena", align, Place::Device).unwrap();
    let end = BufferSlice { buffer: &arena, offset: align, bytes: 0 };
    let mut recorder = device.recorder("empty").unwrap();
    recorder.bind(&affine(&device, 1), &[(0, BufferSlice::whole(&empty)), (1, end)], &push(0, 0)).unwrap();
    recorder.dispatch([1, 1, 1]);
    recorder.dispatch([0, 1, 1]);
    recorder.fill(&empty, 0, 0, 1);
    recorder.finish().unwrap().submit().unwrap().wait().unwrap();
    device.check_validation().unwrap();
}

#[test]
fn scopes_are_timed_in_order_and_nested() {
    let _alone = alone();
    let device = device();
    if !device.info().features.timestamps {
        return;
    }
    let source = upload(&device, &numbers(64));
    let target = device.buffer("target", 256, Place::Readback).unwrap();
    let mut recorder = device.recorder("timed").unwrap();
    recorder.begin_scope("outer");
    // More scopes than one query pool holds.
    for index in 0..150 {
        recorder.begin_scope(&format!("inner {index}"));
        let bindings = [(0, BufferSlice::whole(&source)), (1, BufferSlice::whole(&target))];
        recorder.bind(&affine(&device, 1), &bindings, &push(64, 0)).unwrap();
        recorder.dispatch([1, 1, 1]);
        recorder.end_scope();
        recorder.barrier();
    }
    recorder.end_scope();
    let commands = recorder.finish().unwrap();
    assert!(commands.timings().is_empty(), "nothing has run yet");
    let mut last = 0;
    for _ in 0..2 {
        commands.submit().unwrap().wait().unwrap();
        let timings = commands.timings();
        assert_eq!(timings.len(), 151);
        assert!(timings[0].name == "outer" && timings[0].depth == 0 && timings[0].start_ns >= last);
        for pair in timings[1..].windows(2) {
            assert!(pair[0].depth == 1 && pair[0].start_ns <= pair[0].end_ns && pair[0].end_ns <= pair[1].start_ns);
        }
        assert!(timings[1].start_ns >= timings[0].start_ns && timings[150].end_ns <= timings[0].end_ns);
        assert!(timings[0].end_ns > timings[0].start_ns);
        last = timings[0].end_ns;
    }
    device.check_validation().unwrap();
}

#[test]
fn memory_is_counted_and_given_back() {
    let _alone = alone();
    let device = device();
    assert_eq!(device.memory(), MemoryUse::default());
    let buffer = device.buffer("a", 1 << 20, Place::Device).unwrap();
    let held = device.memory().current;
    assert!((1 << 20..2 << 20).contains(&held), "{held}");
    drop(buffer);
    assert_eq!(device.memory(), MemoryUse { current: 0, peak: held });
}

#[test]
fn oversize_requests_are_refused_with_their_cause() {
    let _alone = alone();
    let device = device();
    let limits = device.info().limits;
    for bytes in [limits.allocation, limits.heap, u64::MAX] {
        let refused = device.buffer("photon_hits", bytes, Place::Device).err().expect("more than the device has");
        let Error::OutOfMemory { object, bytes: asked, cause } = refused else { panic!("{refused:?}") };
        assert!(object == "photon_hits" && asked == bytes, "{object} {asked}");
        let expected = match bytes.saturating_add(32) > limits.allocation {
            true => MemoryCause::BufferTooLong { longest: limits.allocation },
            false => MemoryCause::DeviceFull { left: limits.heap },
        };
        assert_eq!(cause, expected);
    }
    device.check_validation().unwrap();
}

#[test]
fn a_buffer_longer_than_a_binding_is_used_in_parts() {
    let _alone = alone();
    let device = device();
    let limits = device.info().limits;
    if limits.storage_range < (1 << 28).min(limits.allocation) {
        let start = limits.storage_range.next_multiple_of(limits.storage_alignment);
        let bytes = start + 256;
        let large = device.buffer("large", bytes, Place::Device).unwrap();
        let mut recorder = device.recorder("large").unwrap();
        let all = BufferSlice::whole(&large);
        let part = BufferSlice { bytes: limits.storage_range, ..all };
        let refused = recorder.bind(&affine(&device, 1), &[(0, all), (1, part)], &push(0, 0));
        assert!(matches!(refused, Err(Error::OutOfMemory { object, .. }) if object.contains("large")));
        recorder.fill(&large, 0, 256, 20);
        recorder.barrier();
        let tail = BufferSlice { offset: start, bytes: 256, ..all };
        recorder.bind(&affine(&device, 2), &[(0, part), (1, tail)], &push(64, 2)).unwrap();
        recorder.dispatch([1, 1, 1]);
        recorder.barrier();
        let target = device.buffer("target", 256, Place::Readback).unwrap();
        recorder.copy(&large, start, &target, 0, 256);
        recorder.finish().unwrap().submit().unwrap().wait().unwrap();
        assert_eq!(words(&target), [42; 64]);
    }
    device.check_validation().unwrap();
}

#[test]
fn the_device_may_be_dropped_before_its_children_and_nothing_leaks() {
    let _alone = alone();
    let device = device();
    let log = device.validation_log();
    let kernel = affine(&device, 1);
    let buffer = upload(&device, &[1, 2, 3]);
    let commands = device.recorder("idle").unwrap().finish().unwrap();
    let abandoned = device.recorder("abandoned").unwrap();
    drop(device);
    commands.submit().unwrap().wait().unwrap();
    drop((kernel, commands, abandoned));
    assert_eq!(words(&buffer), [1, 2, 3]);
    drop(buffer);
    // The last share is gone: the layer reports whatever was left when the device was destroyed.
    log.check().unwrap();
}

#[test]
fn the_loop_probe_agrees_with_itself() {
    let _alone = alone();
    let device = device();
    let limit = device.loop_limit();
    assert_eq!(limit, device.loop_limit());
    if device.info().driver.contains("Mesa 22.3.6") {
        assert!(limit.is_some_and(|limit| (60_000..=65_536).contains(&limit)), "{limit:?}");
    } else {
        assert!(limit.is_none_or(|limit| limit > 1000), "{limit:?}");
    }
    device.check_validation().unwrap();
}

#[test]
fn selection_is_read_from_text() {
    let _alone = alone();
    assert_eq!("auto".parse::<DeviceSelect>().unwrap(), DeviceSelect::Auto);
    assert_eq!("CPU".parse::<DeviceSelect>().unwrap(), DeviceSelect::Cpu);
    assert_eq!(" 12 ".parse::<DeviceSelect>().unwrap(), DeviceSelect::Index(12));
    assert_eq!("GeForce 4".parse::<DeviceSelect>().unwrap(), DeviceSelect::Name("GeForce 4".into()));
    assert!("".parse::<DeviceSelect>().is_err());
    let nowhere = DeviceOptions { select: DeviceSelect::Name("no such device".into()), ..options() };
    assert!(matches!(Device::open(&nowhere), Err(Error::NoDevice(what)) if what.contains("no such device")));
}
