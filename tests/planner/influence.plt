:- use_module(library(plunit)).
:- use_module(kb_rules(facts)).
:- use_module(planner_golog(projection)).
:- use_module(planner_golog(guide)).
:- use_module(planner_golog(influence)).
:- use_module(planner_golog(alike)).
:- use_module(planner_golog(travel)).

% r1 and r2 are alike; Fill makes full what Use needs; Move moves a robot other than its own.

mill :-
    load_facts(
        [ kind(i, r1, 'Robot'), kind(i, r2, 'Robot'), kind(i, r3, 'Robot'), kind(i, r3, 'Lifter'), kind(i, b1, 'Box'), kind(i, b2, 'Box'),
          value(i, color, r1, red), value(i, color, r2, blue), value(i, color, r3, red),
          agent(i, 'Work'(R1), R1), duration(i, 'Work'(_), fixed(10)),
          agent(i, 'Fill'(R2, _), R2), duration(i, 'Fill'(_, _), fixed(10)), effect(i, 'Fill'(_, T2), fluent(full, T2), true), parameter(i, 'Fill'(_, B2), B2, 'Box'),
          agent(i, 'Use'(R3, _), R3), duration(i, 'Use'(_, _), fixed(10)), precondition(i, 'Use'(_, T3), holds(full, T3, true)), parameter(i, 'Use'(_, B3), B3, 'Box'),
          duration(i, 'Count'(_), fixed(5)), precondition(i, 'Count'(T4), holds(full, T4, true)), parameter(i, 'Count'(B4), B4, 'Box'),
          duration(i, 'Scan', fixed(5)), claims(i, 'Scan', door),
          agent(i, 'Move'(R5, _), R5), duration(i, 'Move'(_, _), fixed(10)), effect(i, 'Move'(_, S5), fluent(locatedAt, S5), p1), parameter(i, 'Move'(_, S6), S6, 'Robot'),
          definition(i, 'Both'(R7), F7, [call(F7, fill, 'Fill'(R7, b1)), call(F7, use, 'Use'(R7, b1))])
        ], _).

mill_gone :- drop_facts(i, _).

looking(S) :- no_travel(Travel), situation(i, plan(Travel), 3, 0, S).
work(call(f, w, 'Work'(r1))).
full(B, holds(full, B, true)).

:- begin_tests(influence, [setup(mill), cleanup(mill_gone)]).

test('called are the processes of all branches, and what they call', Names == ['Both', 'Fill', 'Use', 'Work']) :-
    work(W), looking(S), called(choice(f, c, [W, call(f, b, 'Both'(r1))]), S, Names).
test('a condition lasts if nothing called changes it') :- looking(S), full(b1, C), lasting(C, [], ['Work', 'Use'], S).
test('else it does not', fail) :- looking(S), full(b1, C), lasting(C, [], ['Fill'], S).
test('nor does what only acting finds out', fail) :- looking(S), lasting(is_true(loc(f, x)), [], [], S).
test('a comparison is asked for values too', fail) :- looking(S), lasting(compare(less, value(full, b1), 3), [], ['Fill'], S).
test('what a variable of some stands for may be changed', fail) :-
    looking(S), lasting(some([B-'Box'], all([holds(color, r1, red), holds(full, B, true)])), [], ['Fill'], S).
test('but not where it is of another class') :-
    looking(S), lasting(some([B-'Robot'], holds(full, B, true)), [], ['Fill'], S), lasting(is_a(b1, 'Box'), [], ['Fill'], S).
test('independent: steps that neither change nor ask') :- work(W), looking(S), once(independent(conc([W, call(f, a, 'Fill'(r2, b1))]), S)).
test('dependent: what one changes, another asks for',
     [forall(member(Q, [call(f, b, 'Use'(r1, b1)), test(C), if(C, [], W), while(C, W), until(W, C), call(f, b, 'Both'(r1)),
                       foreach(f, e, [X-'Box'], holds(full, X, true), _, W)])), fail]) :-
    full(b1, C), work(W), looking(S), independent(conc([call(f, a, 'Fill'(r2, b1)), Q]), S).
test('dependent: a robot is moved by another', fail) :- looking(S), independent(call(f, m, 'Move'(r1, r2)), S).
test('dependent: priorities, interrupts and deadlines',
     [forall(member(P, [pconc([W]), interrupt(f, i, [], all([]), W), deadline(9, W)])), fail]) :- work(W), looking(S), independent(P, S).

test('waits: a test, a priority, an interrupt, a lookahead',
     forall(member(P, [test(C), pconc([W]), interrupt(f, i, [], C, W), search(W)]))) :-
    full(b1, C), work(W), looking(S), waits(conc([P, W]), S).
test('waits: a branch that asks for what another changes') :-
    full(b1, C), work(W), looking(S), waits(conc([if(C, W, []), call(f, a, 'Fill'(r2, b1))]), S).
test('waits: a computation, for a resource or for a precondition that another changes',
     forall(member(P, [call(f, s, 'Scan'), [call(f, n, 'Count'(b1)), call(f, a, 'Fill'(r2, b1))]]))) :- looking(S), waits(P, S).
test('does not: steps of robots, which are seen to when the robot is free', fail) :-
    work(W), looking(S), waits(conc([W, call(f, a, 'Fill'(r2, b1)), call(f, b, 'Use'(r1, b1))]), S).
test('does not: a condition that nothing changes', fail) :- full(b1, C), work(W), looking(S), waits(if(C, W, []), S).

test('robots are alike that no class which is asked for tells apart', Gs-Hs == [[r1, r2, r3]]-[[r1, r2], [r3]]) :-
    work(W), looking(S), called(W, S, Names), alike(W, Names, S, Gs), alike(pick(f, p, R, 'Lifter', call(f, w, 'Work'(R))), Names, S, Hs).
test('nor that a rule asks for', forall(member(C, [is_a(r1, 'Lifter'), not(some([X-'Lifter'], holds(color, X, red)))]))) :-
    work(W), looking(S), alike(if(C, W, []), ['Work'], S, [_, _|_]).
test('one that is named where a robot is picked is like no other', Gs == [[r1], [r2, r3]]) :-
    work(W), looking(S), P = pick(f, p, _, 'Robot', W), called(P, S, Names), alike(P, Names, S, Gs).
test('and no condition', Gs == [[r1, r3], [r2]]) :-
    looking(S), P = pick(f, p, R, 'Robot', if(holds(color, R, red), call(f, w, 'Work'(R)), [])), called(P, S, Names), alike(P, Names, S, Gs).
test('individuals that are in one group stay together', Grouped == [[r1, r2], [b1]]) :- grouped([b1, r1, r2], [[r1, r2], [r3]], Grouped).

:- end_tests(influence).
