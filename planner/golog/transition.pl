:- module(planner_transition,
          [ trans/4,                    % +Program, +Situation, -Program, -Situation
            final/2,                    % +Program, +Situation
            final/3,                    % +Program, +Situation, -Situation
            instances/7,                % +Frame, +Step, +Vars, +Condition, +Inner-Body, +Situation, -Programs
            turns/7,                    % +Frame, +Step, +Vars, +Condition, +Inner-Body, +Situation, -Turns
            expansion/4,                % +Id, +Head, +Situation, -Body
            close_scope/4,              % +Id, +Head, +Situation, -Situation
            bound_head/3,               % +Head, +Situation, -Head
            step_id/3                   % +Frame, +Step, -Id
          ]).

/** <module> The meaning of programs: trans/4 and final/2, one clause a construct

After De Giacomo, Lesperance, Levesque, "ConGolog" (2000) [ConGolog], and De Giacomo, Lesperance,
Levesque, Sardina, "IndiGolog" (2009) [IndiGolog]; time and agents after Kelly 2008 [MIndiGolog].
The program terms are listed in planner_syntax.

A primitive action is durative: a transition starts it and leaves `running(Id)`, which is final as soon
as the situation says that it has ended. Time passes between transitions: see planner_search (looking
ahead, to the next natural end) and planner_steps (acting, to what the robots report).
*/

:- use_module(library(lists)).
:- use_module(library(apply)).
:- use_module(library(pairs)).
:- use_module(kb_rules(facts), [definition/4]).
:- use_module(planner_golog(projection)).
:- use_module(planner_golog(conditions)).
:- use_module(planner_golog(actions)).
:- use_module(planner_golog(durations)).
:- use_module(planner_golog(guide)).
:- use_module(planner_golog(horizon), [halted/3]).

%!  trans(+Program, +Situation, -Rest, -Next) is nondet.
%
%   One step of Program in Situation may lead to Next, where Rest remains to be done.

trans([P|Ps], S, [P1|Ps], S1) :-                    % sequence, first part: [ConGolog] 3
    trans(P, S, P1, S1).
trans([P|Ps], S, Rest, S1) :-                       % sequence, the first part being done
    final(P, S, S0),
    trans(Ps, S0, Rest, S1).
trans(choice(Frame, Step, Ps), S, picked(Id-N, choice(Frame, Step, Ps), P1), S1) :- % nondeterministic branch: [Golog]
    step_id(Frame, Step, Id),
    ( next_choice(Id, Planned, S) -> N = Planned ; free_choice(S) ),
    nth1(N, Ps, P),
    \+ excluded(Id, N, S),
    take_choice(Id, N, S, S0),
    taken(P, S0, P1, S1).
trans(pick(Frame, Step, V, Class, P), S, picked(Id-X, pick(Frame, Step, V, Class, P), P1), S1) :-
    step_id(Frame, Step, Id),                       % nondeterministic choice of argument, pi: [Golog]
    candidate(Id, Class, X, S),
    take_choice(Id, X, S, S0),
    copy_term(V-P, X-Bound),
    taken(Bound, S0, P1, S1).
trans(picked(Id, Pick, P), S, picked(Id, Pick, P1), S1) :-
    trans(P, S, P1, S1).
trans(star(Frame, Step, P), S, P1, S1) :-           % nondeterministic iteration: [Golog]
    trans(star(Frame, Step, P, 0), S, P1, S1).
trans(star(Frame, Step, P, N), S, [P1, star(Frame, Step, P, N1)], S1) :-
    N1 is N + 1,
    atomic_list_concat([Frame, Step, N], /, Id),
    ( guided(S) -> next_choice(Id, again, S) ; true ),
    \+ excluded(Id, again, S),
    take_choice(Id, again, S, S0),
    trans(P, S0, P1, S1).
trans(if(C, P, Q), S, P1, S1) :-                    % conditional: [ConGolog] 3
    asked(C, S, Answer),
    (   Answer == yes -> trans(P, S, P1, S1) ; Answer == no -> trans(Q, S, P1, S1) ).
trans(while(C, P), S, [P1, while(C, P)], S1) :-     % iteration: [ConGolog] 3
    asked(C, S, yes),
    trans(P, S, P1, S1).
trans(until(P, C), S, [P1, if(C, [], until(P, C))], S1) :- % OWL-S Repeat-Until: the body, then the test
    trans(P, S, P1, S1).
trans(conc(Ps), S, conc(Rest), S1) :-               % concurrency: [ConGolog] 4, true by [MIndiGolog] 4.3
    one_of(Ps, P, Before, After),
    trans(P, S, P1, S1),
    append(Before, [P1|After], Rest).
trans(pconc([P|Ps]), S, pconc(Rest), S1) :-         % prioritized concurrency: [ConGolog] 4
    (   trans(P, S, P1, S1)
    *-> Rest = [P1|Ps]
    ;   unguided(S, Free), \+ trans(P, Free, _, _), % what a plan puts off has precedence all the same
        trans(pconc(Ps), S, pconc(Qs), S1),
        Rest = [P|Qs]
    ).
trans(any_order(Frame, Step, Ps), S, P1, S1) :-     % OWL-S Any-Order: all, not overlapping
    length(Ps, N),
    numlist(1, N, Numbers),
    pairs_keys_values(Parts, Numbers, Ps),
    trans(any_order(Frame, Step, Parts, N), S, P1, S1).
trans(any_order(Frame, Step, Parts, K), S, [P1, any_order(Frame, Step, Rest, K1)], S1) :-
    K1 is K - 1,
    atomic_list_concat([Frame, Step, K], /, Id),
    ( next_choice(Id, Planned, S) -> N = Planned ; free_choice(S) ),
    select(N-P, Parts, Rest),
    \+ excluded(Id, N, S),
    take_choice(Id, N, S, S0),
    taken(P, S0, P1, S1).
trans(interrupt(Frame, Step, Vs, C, P), S, [P1, interrupt(Frame, Step, Vs, C, P)], S1) :-
    triggered(Vs, C, P, S, Bound),                  % interrupt: [ConGolog] 4.4
    trans(Bound, S, P1, S1).
trans(search(P), S, P1, S1) :-                      % lookahead: [IndiGolog]; acting, it waits for a plan
    ( ahead(S, _) -> true ; known(planned, true, S) ),
    trans(P, S, P1, S1).
trans(deadline(Ms, P), S, deadline(Ms, P1), S1) :-  % ends in time, as far as we can foresee
    trans(P, S, P1, S1),
    (   ahead(S, _), log(S1, [started(_, _, _, _, End)|_])
    ->  latest(Ms, S, Latest), End =< Latest
    ;   true
    ).
trans(foreach(F, Step, Vs, C, Inner, P), S, P1, S1) :- % OWL-S For-Each: one concurrent turn an individual
    asked(some(Vs, C), S, yes),
    turns(F, Step, Vs, C, Inner-P, S, Turns),
    findall(Name-Tuple, member(turn(Name, Tuple, _), Turns), Names),
    findall(Q, member(turn(_, _, Q), Turns), Qs),
    (   ahead(S, _) -> S0 = S ; step_id(F, Step, Id), set_data(turns(Id), Names, S, S0) ),
    trans(conc(Qs), S0, P1, S1).
trans(call(Frame, Step, Head0), S, P1, S1) :-       % procedure call, primitive action: [ConGolog] 4
    bound_head(Head0, S, Head),
    step_id(Frame, Step, Id),
    (   one_step(Head, Duration, S)
    ->  agents_of(Head, Agents, S),
        idle(Agents, S),
        may_begin(Id, Head, Agents, S),
        milliseconds(Head, Duration, Milliseconds, S),
        in_order(Id, Head, Agents, S, S0),
        begin_step(Id, Head, Agents, Milliseconds, S0, S1),
        P1 = running(Id)
    ;   may_begin(Id, Head, Agents, S),
        in_order(Id, Head, Agents, S, S0),
        begin_scope(Id, Head, Agents, S0, S2),
        expansion(Id, Head, S2, Body),
        note(begun(Id, Head), S2, S3),
        P1 = scope(Id, Head, Rest),
        trans(Body, S3, Rest, S1)
    ).
trans(scope(Id, Head, P), S, scope(Id, Head, P1), S1) :-
    trans(P, S, P1, S1).
trans(scope(Id, Head, P), S, [], S1) :-             % a composite process ends: its effects hold
    final(P, S, S0),
    close_scope(Id, Head, S0, S1).

%   A choice is a decision that is noted, even where the branch taken has nothing to do, or goes on by what
%   only acting finds out.
taken(P, S, P1, S1) :-
    (   trans(P, S, P1, S1)
    *-> true
    ;   ahead(S, _), \+ final(P, S), halted(P, S, _), P1 = P, S1 = S
    ).
taken(P, S, [], S1) :- final(P, S, S1).

%!  final(+Program, +Situation) is semidet.
%!  final(+Program, +Situation, -Situation) is semidet.
%
%   Program may end in Situation. A choice or pick may not: it is to be taken first. A composite process that
%   has nothing to do has its effects all the same: they hold in the second situation.

final(P, S) :- final(P, S, _).

final([], S, S).
final([P|Ps], S, S1) :- final(P, S, S0), final(Ps, S0, S1).
final(test(C), S, S) :- asked(C, S, yes).           % a test takes no time: [IndiGolog]
final(picked(_, _, P), S, S1) :- final(P, S, S1).
final(star(Frame, Step, P), S, S) :- final(star(Frame, Step, P, 0), S, S).
final(star(Frame, Step, _, N), S, S) :-
    atomic_list_concat([Frame, Step, N], /, Id),
    \+ next_choice(Id, again, S),
    \+ excluded(Id, enough, S).
final(if(C, P, Q), S, S1) :-
    asked(C, S, Answer),
    (   Answer == yes -> final(P, S, S1) ; Answer == no -> final(Q, S, S1) ).
final(while(C, P), S, S1) :-
    asked(C, S, Answer),
    (   Answer == no -> S1 = S ; Answer == yes -> final(P, S, S1) ).
final(until(P, C), S, S1) :- final(P, S, S1), asked(C, S1, yes).
final(conc(Ps), S, S1) :- final(Ps, S, S1).
final(pconc(Ps), S, S1) :- final(Ps, S, S1).
final(any_order(_, _, []), S, S).
final(any_order(_, _, [], _), S, S).
final(interrupt(_, _, _, _, _), S, S).              % between its turns
final(search(P), S, S1) :- final(P, S, S1).
final(deadline(Ms, P), S, S1) :-
    final(P, S, S1),
    (   ahead(S, _) -> latest(Ms, S, Latest), now(S, Now), Now =< Latest ; true ).
final(foreach(F, Step, Vs, C, Inner, P), S, S1) :-
    asked(some(Vs, C), S, Answer),
    (   Answer == no
    ->  S1 = S
    ;   Answer == yes
    ->  instances(F, Step, Vs, C, Inner-P, S, Turns),
        final(Turns, S, S1)
    ).
final(call(Frame, Step, Head0), S, S1) :-           % a composite process that has nothing to do
    bound_head(Head0, S, Head),
    \+ one_step(Head, _, S),
    step_id(Frame, Step, Id),
    may_begin(Id, Head, _, S),
    expansion(Id, Head, S, Body),
    final(Body, S, S0),
    close_scope(Id, Head, S0, S1).
final(running(Id), S, S) :- \+ is_running(Id, S).

% ------------------------------------------------------------------------------------------- parts

close_scope(Id, Head, S0, S) :-
    end_scope(Id, Head, S0, S1),
    apply_effects(Head, S1, S2),
    note(ended(Id, Head), S2, S).

%!  expansion(+Id, +Head, +Situation, -Body) is det.
%
%   The body of a composite process, in the frame Id.

expansion(Id, Head, S, Body) :-
    revision(S, Revision),
    (   definition(Revision, Head, Id, Body)
    ->  true
    ;   throw(error(existence_error(process, Head), _))
    ).

%!  instances(+Frame, +Step, +Vars, +Condition, +Turn, +Situation, -Programs) is det.
%
%   The turns of a for-each: one program for every combination of individuals that satisfies the
%   condition, in order of name. Turn is Inner-Body; Inner becomes the frame of the turn.

instances(Frame, Step, Vars, Condition, Turn, S, Programs) :-
    turns(Frame, Step, Vars, Condition, Turn, S, Turns),
    findall(Program, member(turn(_, _, Program), Turns), Programs).

%!  turns(+Frame, +Step, +Vars, +Condition, +Turn, +Situation, -Turns) is det.
%
%   The same as turn(Name, Individuals, Program).

turns(Frame, Step, Vars, Condition, Inner-Body, S, Turns) :-
    pairs_keys(Vars, Keys),
    findall(Keys, satisfies(Vars, Condition, S), Tuples0),
    sort(Tuples0, Tuples),
    findall(X-x, member([X|_], Tuples), Firsts),
    group_pairs_by_key(Firsts, Counted),
    findall(turn(Name, Tuple, Program),
            ( member(Tuple, Tuples),
              turn_name(Tuple, Counted, Name),
              atomic_list_concat([Frame, Step, Name], /, Inner0),
              copy_term(t(Keys, Inner, Body), t(Tuple, Inner0, Program)) ),
            Turns).

%   A turn is called by its first individual, where that tells it from the others.
turn_name([X|_], Counted, X) :-
    memberchk(X-[_], Counted), !.
turn_name(Tuple, _, Name) :-
    atomic_list_concat(Tuple, +, Name).

triggered(Vars, Condition, P, S, Bound) :-
    pairs_keys(Vars, Keys),
    catch(findall(Keys, satisfies(Vars, Condition, S), Tuples),
          error(depends_on_sensing(_), _), Tuples = []),
    sort(Tuples, [First|_]),
    copy_term(Keys-P, First-Bound).

latest(Milliseconds, S, Latest) :-
    began(S, Began),
    Latest is Began + Milliseconds.

step_id(Frame, Step, Id) :-
    atomic_list_concat([Frame, /, Step], Id).

one_of([P|Ps], P, [], Ps).
one_of([Q|Ps], P, [Q|Before], After) :- one_of(Ps, P, Before, After).

%   Arguments that stand for the value of a fluent: individuals are looked up, data stay where they are.
bound_head(Head0, S, Head) :-
    (   compound(Head0)
    ->  compound_name_arguments(Head0, Name, Args0),
        maplist(bound_argument(S), Args0, Args),
        compound_name_arguments(Head, Name, Args)
    ;   Head = Head0
    ).

bound_argument(S, fluent(P, X), Value) :-
    fluent_value(P, X, Known, S), atom(Known), !, Value = Known.
bound_argument(_, Argument, Argument).

%   Looking ahead all individuals are tried; along a guide, the one that it says or else the first.
candidate(Id, Class, X, S) :-
    (   next_choice(Id, Planned, S) -> X = Planned ; free_choice(S), member_of(Class, X, S) ),
    \+ excluded(Id, X, S).

%   Where a plan is on its way, it is to decide.
free_choice(S) :-
    \+ known(awaiting, true, S).
