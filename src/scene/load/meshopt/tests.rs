//! Streams that the encoder of meshoptimizer 1.0 made, and what its decoder makes of them.

use proptest::prelude::{ProptestConfig, any, prop};

use super::*;
use crate::scene::load::json;

/// Name, mode, filter, count and stride, the stream and what it unpacks to as hexadecimal digits.
type Sample = (&'static str, &'static str, &'static str, [usize; 2], &'static str, &'static str);

/// The stream of a sample.
fn stream(mode: &str, filter: &str, [count, stride]: [usize; 2]) -> Outcome<Stream> {
    let text = format!(r#"{{"mode": "{mode}", "filter": "{filter}", "count": {count}, "byteStride": {stride}}}"#);
    Stream::of(&Part::new("view 0".into(), json::document(&text).unwrap()))
}

fn bytes(digits: &str) -> Vec<u8> {
    (0..digits.len()).step_by(2).map(|at| u8::from_str_radix(&digits[at..at + 2], 16).unwrap()).collect()
}

/// Filters may be off by one in the last place (appendix B).
fn agree(filter: &str, stride: usize, found: &[u8], expected: &[u8]) -> bool {
    let off = |width: usize| {
        let read = |bytes: &[u8]| bytes.iter().rev().fold(0i32, |value, byte| value << 8 | i32::from(*byte));
        found.chunks(width).zip(expected.chunks(width)).all(|(a, b)| (read(a) - read(b)).abs() <= 1)
    };
    found.len() == expected.len()
        && if matches!(filter, "NONE" | "EXPONENTIAL") { found == expected } else { off(stride / 4) }
}

#[test]
fn streams_of_the_encoder_unpack() {
    for (name, mode, filter, size, packed, expected) in SAMPLES {
        let found = stream(mode, filter, size).unwrap().unpack(&bytes(packed)).expect(name);
        assert!(agree(filter, size[1], &found, &bytes(expected)), "{name}: {found:02x?}");
    }
}

#[test]
fn damaged_streams_are_refused() {
    for (name, mode, filter, [count, stride], packed, _) in SAMPLES {
        let packed = bytes(packed);
        let whole = stream(mode, filter, [count, stride]).unwrap();
        for cut in [0, 1, packed.len() / 2, packed.len() - 1] {
            assert!(whole.unpack(&packed[..cut]).is_err(), "{name} cut to {cut}");
        }
        let other: Vec<u8> = [&[packed[0] ^ 0x40], &packed[1..]].concat();
        assert!(whole.unpack(&other).is_err(), "{name} with another header");
        let more = stream(mode, filter, [count + 48, stride]).unwrap();
        assert!(more.unpack(&packed).is_err(), "{name} with more elements");
    }
}

#[test]
fn descriptions_must_be_possible() {
    for (mode, filter, size) in [
        ("ATTRIBUTES", "NONE", [3, 6]),
        ("ATTRIBUTES", "NONE", [3, 260]),
        ("ATTRIBUTES", "NONE", [3, 0]),
        ("ATTRIBUTES", "OCTAHEDRAL", [3, 12]),
        ("ATTRIBUTES", "QUATERNION", [3, 4]),
        ("ATTRIBUTES", "SOMETHING", [3, 4]),
        ("TRIANGLES", "NONE", [4, 4]),
        ("TRIANGLES", "NONE", [3, 1]),
        ("INDICES", "NONE", [3, 8]),
        ("OTHER", "NONE", [3, 4]),
    ] {
        assert!(stream(mode, filter, size).is_err(), "{mode} {filter} {size:?}");
    }
}

proptest::proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn mutated_streams_never_panic(
        which in 0..SAMPLES.len(),
        edits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
    ) {
        let (_, mode, filter, size, packed, _) = SAMPLES[which];
        let mut packed = bytes(packed);
        for (at, value) in edits {
            let at = at.index(packed.len());
            packed[at] = value;
        }
        let stream = stream(mode, filter, size).unwrap();
        if let Ok(bytes) = stream.unpack(&packed) {
            assert_eq!(bytes.len() as u64, stream.bytes());
        }
    }
}

#[rustfmt::skip]
const SAMPLES: [Sample; 13] = [
    ("bytes v0", "ATTRIBUTES", "NONE", [40, 8],
        "a02a066666666666666666666666666666666666666600000000001527e666666f7067e666666f7067e600006f70001f00b7428b4248\
         42fe90afd249e80a503b181c6f53d6845bc1e186cc1cbe4367c9ffff00000604b80ae4b7de362a01f1fe5101683ffb140f1116c07072\
         8d0f2f430f121312ff34369400000000111200000000000000000000000000000000000000000000000000000007000083020000",
        "0007000083020000030701002701000006070000480b00000907c800020a00000c070000230200000f07010047090000120700006806\
         000015070100e7050000180700002f0500001b070100d70400001e07000040070000210701001b0b0000240700008f09000027070100\
         940000002a070000bc0b00002d0701009e05000030070000aa0b000033070100b80b000036070000800700003907c800560700003c07\
         0000c10300003f0701000304000042070000d5080000450701007401000048070000030100004b070100460a00004e070000ac0b0000\
         51070100ba010000540700001903000057070100f70100005a070000c30100005d0701005e0a0000600700006101000063070100630a\
         000066070000bf0800006907c800c40a00006c070000360800006f070100da0b000072070000490600007507010064080000"),
    ("bytes v1", "ATTRIBUTES", "NONE", [40, 8],
        "a199a72a0666666666666666666666666666666666666666000000001527e666666f7067e666666f7067e600006f70000173c081c731\
         d157ce09952b9bba010da3172addaa4fd4487415c666f3e2e669fca47bd4bb8dd72a0575f001d2c4f0e714135e4ffd083a0ff25b0f12\
         1512e911eba000000000000000000000000000000000000000070000490a00000000",
        "00070000490a00000307010048070000060700000e0300000907c8006e0000000c0700002d0a00000f070100c90a000012070000b00a\
         00001507010047090000180700001b0200001b070100820300001e0700007d09000021070100320b0000240700001c01000027070100\
         ce0100002a0700002b0800002d0701002a040000300700002301000033070100d108000036070000c50a00003907c800da0200003c07\
         00006b0b00003f070100c00400004207000098040000450701000208000048070000260600004b070100600b00004e070000550b0000\
         51070100b800000054070000eb09000057070100710a00005a070000e20700005d070100550100006007000020080000630701009e03\
         000066070000f00200006907c800b20100006c0700001c0800006f070100be0200007207000077070000750701000b070000"),
    ("floats v1 level 3", "ATTRIBUTES", "NONE", [20, 12],
        "a1ff3f7f00b5a3dbbebdbd739d651d1f7ee1ca83b54b30eb007b55ad69abf6e6767d2890e0bd27ce445c372d004ffc9060562e201a14\
         0c04010913171f25535d007cfdfffffffdfffffffffffffffffffffffeff0041653bdd050d0398d977ed5b2553afd3c59fb500830c5e\
         7e8854639a8951186923792f74e03aa40061da59e3f8767f253696a078f02165341405020300f0013443100f00ffff008df9eba19315\
         f757315bc3fb2d113e23f115d10011d3169b49bf602079d5a6e07143979c139f8e002d0b04030d2f1a60d95aef8f2054c8e8a3a07900\
         00f2ff010307070300030100000000000000000000000000fb8f2140ca952e40001212",
        "00000000fb8f2140ca952e40a5c2d83e5b4e11c00c1d38c0539756bf6948fc3ff0f43d40e5409e3f74e7d0bf85ff3fc0440bcebf1a58\
         a13f55323e40e5b5f93f181c5dbf9c9638c0863010c01e36e63e16492f404ca320409f87d9bc6d7922c0fdde2dc0d34acbbe46691240\
         ca9f37403f0e503fded5febfbbb33dc084269bbf73bfd33fabfb3f40f22acb3f126ca4bfea6b3ec05f1ef7bf6f9c633f790c3940cd0f\
         0f40f9a4f3bedef82fc064b31fc07185593d9c5f2340b3242d40eecebd3e418113c0da1e37c0ff8049bf1baf0040b86e3d400709983f\
         3393d6bff7f33fc08d46c8bfbd7ca73fada13e40e581f43f"),
    ("shorts v1", "ATTRIBUTES", "NONE", [20, 8],
        "a17777009d9da39d9da39d9da39d9da39d9da39d9da39d020aa8aa8aaa8aa8aa0f00080a0a08009da39d9da39d9da39d9da39d9da39d\
         9da39d9d0208aa8aa8aa8aa8aa0f000a080a0a00a39d9da39d9da39d9da39d9da39d9da39d9da30208aa8aaa8aa8aa8a0f000a080a0a\
         009d9da39d9da39d9da39d9da39d9da39d9da39d020a8aa8aa8aa8aa8a0f000a0a080a0000000000000000000000000000d8dc05de32\
         df5ce00000",
        "d8dc05de32df5ce089e1b6e2e0e30de53ae664e791e8bee9e8ea15ec42ed6cee99efc6f0f0f11df34af474f5a1f6cef7f8f825fa52fb\
         7cfca9fdd6fe00002d015a028403b104de050807350862098c0ab90be60c100e3d0f6a109411c112ee131815451672179c18c919f61a\
         201c4d1d7a1ea41fd120fe21282355248225ac26d9270629302a5d2b8a2cb42de12e0e30383165329233bc34e935163740386d39"),
    ("triangles", "TRIANGLES", "NONE", [105, 4],
        "e1fe1e100e100e100ece1e160e150e140ece1e140e140e140ece1e140e140e140effffff0f0a8f290cff162312f2cac508ddc5080076\
         87566778a9866589689801690000",
        "000000000100000005000000050000000100000006000000060000000100000002000000060000000200000007000000070000000200\
         00000300000007000000030000000800000008000000030000000400000008000000040000000900000005000000060000000a000000\
         0a000000060000000b0000000b00000006000000070000000b000000070000000c0000000c00000007000000080000000c0000000800\
         00000d0000000d00000008000000090000000d000000090000000e0000000a0000000b0000000f0000000f0000000b00000010000000\
         100000000b0000000c000000100000000c00000011000000110000000c0000000d000000110000000d00000012000000120000000d00\
         00000e000000120000000e000000130000000f0000001000000014000000140000001000000015000000150000001000000011000000\
         150000001100000016000000160000001100000012000000160000001200000017000000170000001200000013000000170000001300\
         00001800000003000000110000000900000014000000020000000b000000701101000100000002000000"),
    ("triangles 16", "TRIANGLES", "NONE", [102, 2],
        "e1fe1e100e100e100ece1e160e150e140ece1e140e140e140ece1e140e140e140effff0f0a8f290cff162312007687566778a9866589\
         689801690000",
        "000001000500050001000600060001000200060002000700070002000300070003000800080003000400080004000900050006000a00\
         0a0006000b000b00060007000b0007000c000c00070008000c0008000d000d00080009000d0009000e000a000b000f000f000b001000\
         10000b000c0010000c00110011000c000d0011000d00120012000d000e0012000e0013000f0010001400140010001500150010001100\
         150011001600160011001200160012001700170012001300170013001800030011000900140002000b00"),
    ("indices", "INDICES", "NONE", [11, 4],
        "d1000404a11f04050405b08b11931f1300000000",
        "000000000100000002000000e803000003000000e903000004000000ea030000701101000500000000000000"),
    ("octahedral 4", "ATTRIBUTES", "OCTAHEDRAL", [6, 4],
        "a1af001d970b6c61006a6c72166b0000000000000000000000000000000000000032b37f7f00",
        "4595007f37da6c7fbb325e7fc771f67f097c1c7fb74c477f"),
    ("octahedral 8", "ATTRIBUTES", "OCTAHEDRAL", [6, 8],
        "a1ffaa002272b7c61f00010900060500c0b6cd8dd30006060802070000000000000000000000000000200321fbff07ff7f0000",
        "1d4545940000ff7f6f3728dafd6cff7f9cbae531485fff7fa9c61172d3f6ff7fe708a37cbb1bff7f5bb7a74c5248ff7f"),
    ("quaternion", "ATTRIBUTES", "QUATERNION", [4, 8],
        "a1ffbf00bfa61a002c3f1400bf9ba3002c693e00bf4bc0002c352d000502000000000000000000000000000000000000000000ff1f00\
         00",
        "000000000000ff7fff3f00400040004034f3a05966e638a935b3666600000000"),
    ("exponential", "ATTRIBUTES", "EXPONENTIAL", [2, 12],
        "a1efeeff0012007a00280010000400f500b600020010000000000000000000000000f2003000f3aed8ffe7000000",
        "000000000000c03f00489db9002474490000e04000cccc3d"),
    ("color 4", "ATTRIBUTES", "COLOR", [3, 4],
        "a1ff008ef20050b200720c007d7f00000000000000000000000000000000000000407fc1ff00",
        "fe0100ff3481e68000000000"),
    ("color 8", "ATTRIBUTES", "COLOR", [3, 8],
        "a1ffff00cecd00080f00d0cd00190c00cdcc00060200020000050700000000000000000000000000000004ff0701fcff0f0000",
        "efff10000000ffff433318806ee608800000000000000000"),
];
