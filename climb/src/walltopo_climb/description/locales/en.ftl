# Sentences about a route, read aloud to a climber: one message for each kind of step and detail.
# $limb, $origin: left_hand, right_hand, left_foot, right_foot. $type: a type of holds.
# $size: small, medium, large. $clock: 1 to 12; 0: no direction. $unit: centimetres or hands.
# $distance, $apart: in that unit. $height: metres. $steepness: degrees, not negative. $wall: slab,
# vertical or overhang.

limb = { $limb ->
    [left_hand] Left hand
    [right_hand] Right hand
    [left_foot] Left foot
   *[right_foot] Right foot
}
limb-short = { $limb ->
    [left_hand] Left
    [right_hand] Right
    [left_foot] Left foot
   *[right_foot] Right foot
}
origin = { $origin ->
    [left_hand] from the left hand
    [right_hand] from the right hand
    [left_foot] from the left foot
   *[right_foot] from the right foot
}
type = { $type ->
    [jug] jug
    [rail] rail
    [edge] edge
    [pocket] pocket
    [pinch] pinch
    [crimp] crimp
    [sloper] sloper
    [volume] volume
    [foothold] foothold
   *[unknown] hold
}
sized = { $size ->
    [small] small { type }
    [large] large { type }
   *[medium] { type }
}
clock = { $clock ->
    [0] close by
   *[other] { $clock } o'clock
}
distance = { $unit ->
    [hands] { $distance ->
        [one] { $distance } hand width
       *[other] { $distance } hand widths
    }
   *[centimetres] { $distance ->
        [one] { $distance } centimetre
       *[other] { $distance } centimetres
    }
}
apart = { $unit ->
    [hands] { $apart ->
        [one] { $apart } hand width apart
       *[other] { $apart } hand widths apart
    }
   *[centimetres] { $apart ->
        [one] { $apart } centimetre apart
       *[other] { $apart } centimetres apart
    }
}
height = { $height ->
    [one] { $height } metre above the floor
   *[other] { $height } metres above the floor
}
wall = { $wall ->
    [slab] { $steepness ->
        [one] a slab of { $steepness } degree
       *[other] a slab of { $steepness } degrees
    }
    [overhang] { $steepness ->
        [one] overhanging by { $steepness } degree
       *[other] overhanging by { $steepness } degrees
    }
   *[vertical] vertical
}
hands = { $hands ->
    [one] { $hands } hand hold
   *[other] { $hands } hand holds
}
moves = { $moves ->
    [one] { $moves } hand move
   *[other] { $moves } hand moves
}

route = { $name }: { hands }, { moves }, top { height }, { wall }.
route-short = { $name }: { moves }.
start = Start. { limb }: { type }, { height }.
start-short = Start. { limb-short }: { type }, { height }.
start-full = Start. { limb }: { sized }, { height }.
start_other = { limb }: { type }, { height }, { apart }.
start_other-full = { limb }: { sized }, { height }, { apart }.
start_with_both = Start: both hands on the { type }, { height }.
start_with_both-full = Start: both hands on the { sized }, { height }.
start_foot = { limb }: { type }, { height }.
start_foot-full = { limb }: { sized }, { height }.
steepness = The wall is now { wall }.
hand = { limb }: { clock }, { distance }, { type }.
hand-short = { limb-short }: { clock }, { distance }.
hand_from_other = { limb }: { clock }, { distance } { origin }, { type }.
hand_from_other-short = { limb-short }: { clock }, { distance } { origin }.
hand_from_other-full = { limb }: { clock }, { distance } { origin }, { sized }, { height }.
hand-full = { limb }: { clock }, { distance }, { sized }, { height }.
match = { limb }: to the hold of the other hand.
jump = Jump! { limb }: { clock }, { distance }, { type }.
jump-short = Jump! { limb-short }: { clock }, { distance }.
jump_from_other = Jump! { limb }: { clock }, { distance } { origin }, { type }.
jump_from_other-short = Jump! { limb-short }: { clock }, { distance } { origin }.
jump_from_other-full = Jump! { limb }: { clock }, { distance } { origin }, { sized }, { height }.
jump-full = Jump! { limb }: { clock }, { distance }, { sized }, { height }.
foot = { limb }: { clock }, { distance }, { type }.
foot_from_other = { limb }: { clock }, { distance } { origin }, { type }.
foot_from_other-full = { limb }: { clock }, { distance } { origin }, { sized }, { height }.
foot-full = { limb }: { clock }, { distance }, { sized }, { height }.
foot_off = { limb }: off the wall.
top = Top: { type }, { height }.
top-full = Top: { sized }, { height }.
out_of_reach = The next hold is out of reach at this height.
